"""What the detector computes for a picture: which networks see it, how large, and how close it looks at each person."""
from dataclasses import dataclass, replace
from typing import Dict, Tuple

from openpose_ros_pkg.errors import ParameterError
from openpose_ros_pkg.networks.models import AUTO, MOBILENET_THIN, MOVENET_MULTIPOSE, Model, find_model
from openpose_ros_pkg.params.parameters import Parameters, parameter
from openpose_ros_pkg.skeletons import SkeletonModel


@dataclass(frozen=True)
class DetectorParams(Parameters):
    """Which networks look at a picture, how large, and how often. Names of sizes and scales are OpenPose's.

    Raises:
        ParameterError: the scales reach zero, or the box has no side.
    """

    mode: str = parameter(
        'balanced', 'How much is computed for a picture: fast, for weak machines, finds six people at most; balanced; '
                    'accurate, for pictures and recordings, takes about ten times as long as balanced.',
        choices=('fast', 'balanced', 'accurate'))
    pose_model: str = parameter(
        AUTO, 'Network: auto, the networks that the mode puts together (COCO, the joint set that OpenPose calls so, '
              'means the same); or one network alone: mobilenet_thin, movenet_multipose, body_25, ... (`./run model '
              'list`), or a .yaml file that describes one of your own.')
    model_folder: str = parameter(
        '', 'Folder with the weights (<folder>/<network>/<file> or <folder>/<file>); empty: where setup puts them.')
    net_input_width: int = parameter(
        0, 'Width of the box that the image is fitted into for the first network, aspect kept; -1: as the height makes '
           "it; 0: the mode's, or -1 where the height is given. Time goes with width times height. Smaller is faster, "
           'larger finds smaller people.', unit='px', minimum=-1, maximum=4096)
    net_input_height: int = parameter(
        0, "Height of that box; -1: as the width makes it; 0: the mode's, or -1 where the width is given.", unit='px',
        minimum=-1, maximum=4096)
    num_scales: int = parameter(
        0, 'Number of sizes at which the first network sees the image, averaged; each costs time, more of them find '
           "more people of very different size. 0: the mode's.", minimum=0, maximum=8)
    scale_gap: float = parameter(
        0.0, "Each size is smaller than the one before by this share of the first. 0: the mode's, or 0.3 where "
             'num_scales is given.', minimum=0.0, maximum=0.99)
    mirror: str = parameter(
        'auto', 'Average also over the mirror image, which doubles the time and makes joints more accurate; auto: as '
                'the mode has it.', choices=('auto', 'always', 'never'))
    look_closer: int = parameter(
        -1, "Number of people at most that are cut out of the picture and looked at again, the surest first; -1: the "
            "mode's; 0: nobody. Not with a single network.", minimum=-1, maximum=100)
    target_rate: float = parameter(
        0.0, 'Compute less than the mode would, as far as this processor needs to reach this rate; the log says what '
             'came out. 0: never, so that results do not depend on the machine. Not with the mode accurate.',
        unit='Hz', minimum=0.0, maximum=1000.0)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.net_input_width < 0 and self.net_input_height < 0:
            raise ParameterError("parameters 'net_input_width', 'net_input_height' = -1, -1 are not allowed: -1 for "
                                 'one of them')
        zooms = _wanted_zooms(self, MODES[self.mode].looks[0].zooms)
        if zooms[-1] <= 0:
            raise ParameterError(f"parameters 'num_scales', 'scale_gap' = {self.num_scales}, {self.scale_gap} are not "
                                 f'allowed: the last of {len(zooms)} scales would be {zooms[-1]:g}, expected above 0')


@dataclass(frozen=True)
class Look:
    """One network that sees the whole picture.

    Attributes:
        model: the network.
        box: (width, height) that the picture is fitted into [px]; -1 for one of them: as the other makes it.
        zooms: factors on the box. The fields of a network with part affinity fields are averaged over them; any other
            network gives an opinion for each.
        mirror: also average over the mirror image; only of networks with part affinity fields.
        weight: of this opinion where several are put together.
    """

    model: Model
    box: Tuple[int, int]
    zooms: Tuple[float, ...] = (1.0,)
    mirror: bool = False
    weight: float = 1.0

    @property
    def opinions(self) -> int:
        """Number of opinions on a person that it gives."""
        return 1 if self.model.decoder == 'paf' else len(self.zooms)

    @property
    def description(self) -> str:
        """What is computed, for people."""
        scales = f' at {len(self.zooms)} scales' if len(self.zooms) > 1 else ''
        return f"{self.model.name} {self.box[0]}x{self.box[1]}{scales}{' mirrored too' if self.mirror else ''}"


@dataclass(frozen=True)
class CloserLook:
    """A network that sees each person once more, cut out of the picture.

    Attributes:
        margin: side of the square cut-out, in units of the longer side of the box round the person's joints.
        mirror: look at the mirror image.
    """

    margin: float
    mirror: bool = False


# OpenPose's default, flags.hpp.
_SCALE_GAP = 0.3
# The network of closer looks.
CLOSE_MODEL = MOVENET_MULTIPOSE


@dataclass(frozen=True)
class Recipe:
    """All that is computed for a picture.

    Attributes:
        looks: the networks that see the whole of it.
        closer: how each person found is looked at again.
        most_people: no more than so many people are looked at again, the surest first; bounds the time.
        close_side: side of the network's input for a closer look [px]; of 192, 256 and 320, 256 was the most accurate.
        acceptance: factor on the scores that joints and people need; the more opinions there are, the more of them are
            silent on one who is there.
    """

    looks: Tuple[Look, ...]
    closer: Tuple[CloserLook, ...] = ()
    most_people: int = 6
    close_side: int = 256
    acceptance: float = 1.0

    @property
    def models(self) -> Tuple[Model, ...]:
        """The networks that it takes, each once."""
        close = (CLOSE_MODEL,) if self.closer else ()
        return tuple({model.name: model for model in (*(look.model for look in self.looks), *close)}.values())

    @property
    def skeleton(self) -> SkeletonModel:
        """Joint set of the people, that of the first look."""
        return self.looks[0].model.skeleton

    @property
    def weights(self) -> Tuple[float, ...]:
        """Weights of the opinions on a person: those of the whole looks in their order, then the closer ones."""
        whole = tuple(look.weight for look in self.looks for _ in range(look.opinions))
        return whole + (1.0,) * len(self.closer)

    @property
    def whole_opinions(self) -> int:
        """Number of opinions that the whole looks give."""
        return sum(look.opinions for look in self.looks)

    @property
    def is_ensemble(self) -> bool:
        """Whether there are several opinions on a person."""
        return len(self.weights) > 1

    @property
    def description(self) -> str:
        """What is computed, for people."""
        looks = ' + '.join(look.description for look in self.looks)
        return looks + (
            f' + {len(self.closer)} closer at {self.close_side} for {self.most_people} people' if self.closer else '')

    def without(self, model: Model) -> 'Recipe':
        """Return what is left of it without a network that is not the first."""
        looks = tuple(look for look in self.looks if look.model is not model)
        return replace(self, looks=looks, closer=() if model is CLOSE_MODEL else self.closer)


def _thin(scale: float, weight: float = 1.5) -> Look:
    return Look(MOBILENET_THIN, _box(656 * scale, 368 * scale), weight=weight)


def _movenet(*sides: int) -> Look:
    return Look(MOVENET_MULTIPOSE, (sides[0], sides[0]), tuple(side / sides[0] for side in sides))


def _box(width: float, height: float) -> Tuple[int, int]:
    """Return a box whose sides are multiples of 8, the stride of the networks with part affinity fields."""
    return int(width) // 8 * 8, int(height) // 8 * 8


_ONE_CLOSER = (CloserLook(1.6),)

# MoveNet finds large people well, up to six, mobilenet_thin small ones and crowds; each finds people that the other
# misses, and where both see a joint its place is surer. A closer look brings most for its time. The mirror image and
# other sizes come next. Average precision and time of each: docs/accuracy_and_speed.md.
MODES: Dict[str, Recipe] = {
    'fast': Recipe((_movenet(384),), _ONE_CLOSER),
    'balanced': Recipe((_thin(1.0), _movenet(512)), _ONE_CLOSER),
    'accurate': Recipe(
        (Look(MOBILENET_THIN, _box(984, 552), (1.0, 2 / 3, 1 / 3), mirror=True, weight=3.0), _movenet(512, 256)),
        tuple(CloserLook(margin, mirror) for margin in (1.6, 2.0) for mirror in (False, True)), most_people=20,
        acceptance=0.8),
}

# From the mode balanced down: what is less accurate and faster, for processors that do not reach the wanted rate.
FASTER: Tuple[Recipe, ...] = (
    MODES['balanced'],
    Recipe((_thin(0.75), _movenet(384)), _ONE_CLOSER),
    Recipe((_thin(0.5, weight=1.0), _movenet(384)), _ONE_CLOSER),
    MODES['fast'],
    Recipe((_movenet(256),), _ONE_CLOSER),
    Recipe((_movenet(256),), _ONE_CLOSER, close_side=192),
)


def recipe_of(params: DetectorParams) -> Recipe:
    """Return what the parameters ask for.

    Raises:
        ParameterError: no such network.
        ModelError: its description is wrong.
    """
    recipe = MODES[params.mode]
    if params.pose_model not in (AUTO, 'COCO'):
        recipe = _alone(find_model(params.pose_model, params.model_folder), recipe)
    look = recipe.looks[0]
    mirror = look.mirror if params.mirror == 'auto' else params.mirror == 'always' and look.model.decoder == 'paf'
    look = replace(look, box=_wanted_box(params, look.box), zooms=_wanted_zooms(params, look.zooms),
                   mirror=mirror)
    recipe = replace(recipe, looks=(look, *recipe.looks[1:]))
    if params.look_closer == 0:
        return replace(recipe, closer=())
    return recipe if params.look_closer < 0 else replace(recipe, most_people=params.look_closer)


def _alone(model: Model, recipe: Recipe) -> Recipe:
    """Return what a network computes without others in a mode: OpenPose's input, larger, or smaller."""
    first = next((look for look in recipe.looks if look.model.decoder == 'paf'), _thin(0.5))
    return Recipe((replace(first, model=model, mirror=first.mirror and model.decoder == 'paf'),))


def _wanted_box(params: DetectorParams, box: Tuple[int, int]) -> Tuple[int, int]:
    """Return the box that the parameters ask for, or the mode's."""
    width, height = params.net_input_width, params.net_input_height
    return width or (-1 if height > 0 else box[0]), height or (-1 if width > 0 else box[1])


def _wanted_zooms(params: DetectorParams, zooms: Tuple[float, ...]) -> Tuple[float, ...]:
    """Return the scales that the parameters ask for, or the mode's."""
    if params.num_scales == 0 and params.scale_gap == 0:
        return zooms
    gap = params.scale_gap or _SCALE_GAP
    return tuple(1 - i * gap for i in range(params.num_scales or len(zooms)))
