"""People drawn from a seed: bodies, skin, clothes and hair of one of the disjoint sets."""
import colorsys
from typing import Optional

import numpy as np

from .body import Cloth, Color, PersonSpec
from .garments import HAIR, OUTFITS, SHOES

SKIN_TONES = ((232, 190, 168), (214, 164, 136), (190, 142, 110), (160, 114, 84), (124, 84, 60), (88, 58, 44))
HAIR_COLORS = ((28, 25, 24), (52, 38, 30), (92, 62, 40), (186, 150, 98), (140, 138, 136), (140, 70, 38))
PATTERNS = ('', '', '', 'stripes', 'columns', 'check', 'block', 'logo', 'camouflage')
STEPS = 12  # cells of tones and hues; those of the two sets alternate
CHILD_SHARE = 0.12


def _cell(rng: np.random.Generator, people: str) -> float:
    """Return a value 0..1 from the cells of a set: the even ones for tune, the odd ones for report."""
    return (2 * rng.integers(0, STEPS // 2) + (people == 'report') + rng.uniform(0.05, 0.95)) / STEPS


def _color(rng: np.random.Generator, people: str, dark: float = 0.2) -> Color:
    """Return a colour of cloth; a third is nearly gray, some are dark."""
    saturation = rng.uniform(0, 0.15) if rng.random() < 0.35 else rng.uniform(0.2, 0.8)
    value = rng.uniform(0.1, 0.3) if rng.random() < dark else rng.uniform(0.3, 0.95)
    red, green, blue = colorsys.hsv_to_rgb(_cell(rng, people), saturation, value)
    return (round(255 * red, 1), round(255 * green, 1), round(255 * blue, 1))


def _mixed(tones: tuple, place: float) -> Color:
    table = np.array(tones, float)
    at = place * (len(table) - 1)
    red, green, blue = (float(np.interp(at, np.arange(len(table)), channel)) for channel in table.T)
    return (round(red, 1), round(green, 1), round(blue, 1))


def random_person(rng: np.random.Generator, people: str, child: Optional[bool] = None) -> PersonSpec:
    """Return a person of a set (tune or report): statures of 1.0 to 2.0 m, children below 1.45 m.

    child: None draws it.
    """
    is_child = rng.random() < CHILD_SHARE if child is None else child
    is_female = rng.random() < 0.5
    stature = rng.uniform(1.0, 1.45) if is_child else np.clip(rng.normal(1.65 if is_female else 1.77, 0.09), 1.48, 2.0)
    age = 0.33 + 0.3 * (stature - 1.0) if is_child else rng.uniform(0.6, 0.98)
    side = 'female' if is_female else 'male'
    top = Cloth(_color(rng, people), str(rng.choice(PATTERNS)), _color(rng, people), rng.uniform(0.04, 0.10),
                rng.uniform(0.66, 0.78) * stature)
    hair_color = _mixed(HAIR_COLORS[4:5] * 2, 0) if age > 0.85 and rng.random() < 0.6 else \
        HAIR_COLORS[int(rng.integers(0, len(HAIR_COLORS)))]
    return PersonSpec(
        gender=float(np.clip((0.95 if is_female else 0.05) + rng.normal(0, 0.04), 0, 1)), stature=round(stature, 3),
        age=round(age, 3), muscle=rng.uniform(0.35, 0.75), weight=float(np.clip(rng.normal(0.52, 0.14), 0.25, 0.9)),
        proportions=rng.uniform(0.35, 0.75), outfit=str(rng.choice(OUTFITS[people][side])),
        shoes=str(rng.choice(SHOES[people])), hair=str(rng.choice(HAIR[people][side])),
        skin=_mixed(SKIN_TONES, _cell(rng, people)), hair_color=hair_color, top=top,
        bottom=Cloth(_color(rng, people, 0.4)), shoe_color=_color(rng, people, 0.5), accent=_color(rng, people, 0.5))
