"""The people of the scenarios by hand."""
from typing import Dict, Tuple

from ..people.body import Body, Cloth, PersonSpec
from ..people.rig import Rig

_SKIN = {'fair': (228, 184, 160), 'light': (214, 164, 136), 'olive': (190, 142, 110), 'tan': (160, 114, 84),
             'brown': (124, 84, 60)}
_HAIR = {'black': (28, 25, 24), 'dark_brown': (52, 38, 30), 'brown': (92, 62, 40), 'grey': (140, 138, 136),
         'red': (140, 70, 38)}


def _person(shape: Tuple[float, ...], clothes: Tuple[str, str, str], tones: Tuple[str, str], top: Cloth, bottom: Cloth,
            **colors: Tuple[float, float, float]) -> PersonSpec:
    """shape: gender, stature [m], age, muscle, weight; clothes: outfit, shoes, hair; tones: of skin and hair."""
    gender, stature, age, muscle, weight = shape
    return PersonSpec(gender, stature, age, muscle, weight, 0.5, *clothes, _SKIN[tones[0]], _HAIR[tones[1]], top,
                      bottom,
                      **colors)


CAST: Dict[str, PersonSpec] = {
    'adam': _person((0.0, 1.80, 0.66, 0.6, 0.5), ('male_casualsuit02', 'shoes03', 'short02'), ('light', 'dark_brown'),
                 Cloth((168, 52, 46)), Cloth((58, 72, 104))),
    'bea': _person((1.0, 1.66, 0.65, 0.5, 0.45), ('female_casualsuit01', 'shoes01', 'ponytail01'), ('fair', 'red'),
                Cloth((88, 120, 164), 'stripes', (225, 228, 230), 0.05), Cloth((46, 48, 58)), shoe_color=(112, 84, 62)),
    'carl': _person((0.05, 1.74, 0.85, 0.5, 0.72), ('male_casualsuit04', 'shoes05', 'short04'), ('brown', 'black'),
                 Cloth((214, 206, 188), 'check', (70, 96, 80), 0.07), Cloth((96, 86, 68)), shoe_color=(40, 38, 38)),
    'dora': _person((0.95, 1.72, 0.75, 0.45, 0.58), ('female_casualsuit02', 'shoes02', 'bob02'), ('olive', 'black'),
                 Cloth((60, 132, 96)), Cloth((118, 112, 104)), shoe_color=(180, 60, 60)),
    'ed': _person((0.0, 1.86, 0.7, 0.7, 0.42), ('male_casualsuit06', 'shoes04', 'short01'), ('tan', 'brown'),
               Cloth((228, 170, 60), 'logo', (40, 44, 60), height=0.27), Cloth((44, 46, 52)),
               shoe_color=(200, 200, 196)),
    'finn': _person((0.05, 1.77, 0.62, 0.55, 0.52), ('male_casualsuit02', 'shoes03', 'short01'), ('fair', 'brown'),
                 Cloth((160, 56, 50)), Cloth((60, 72, 100))),
    'gil': _person((0.0, 1.72, 0.88, 0.5, 0.6), ('male_casualsuit05', 'shoes01', 'short02'), ('olive', 'grey'),
                Cloth((52, 66, 108)), Cloth((120, 100, 76)), shoe_color=(60, 44, 36)),
    'hana': _person((1.0, 1.69, 0.66, 0.55, 0.5), ('female_sportsuit01', 'shoes05', 'long01'), ('tan', 'black'),
                 Cloth((236, 232, 222)), Cloth((78, 44, 60)), shoe_color=(220, 220, 214))}


def rig(name: str) -> Rig:
    """Build a person of the cast."""
    return Rig(Body(CAST[name]))
