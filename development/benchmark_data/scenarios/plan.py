"""What is drawn for a random scene before anything is built: people, sensor, camera, light. Needs no Anny."""
from typing import Any, Dict, NamedTuple, Tuple

import numpy as np

from ..people.random_people import random_person
from ..rendering.camera import Intrinsics
from ..rendering.color_camera import Exposure
from ..rendering.depth_sensors import SENSORS
from ..rendering.renderer import Light

SETS = {'tune': 1, 'report': 2, 'committed': 3}  # the first number of the seeds of a set
KINDS = ('stand', 'turn', 'walk', 'cross', 'meet', 'hand_over', 'hug', 'sit', 'table', 'kneel', 'lie', 'group')
# People by kind; others 1 to 3. So many of them are no children.
COUNTS = {'meet': (2, 4), 'hand_over': (2, 4), 'hug': (2, 4), 'cross': (2, 4), 'group': (4, 6), 'signals': (2, 2),
          'stage': (3, 4)}
ADULTS = {'hug': 2, 'hand_over': 2, 'table': 1, 'lie': 1, 'signals': 2, 'stage': 4}
SPECIAL = {'signals': 500, 'stage': 600}  # scenes of gestures and of several cameras: their first number in a set
LIGHTS = ('dim', 'normal', 'bright')


class View(NamedTuple):
    """Sensor and place of the camera of a scene; horizontal half angle as a tangent."""

    sensor: str
    intrinsics: Intrinsics
    height: float
    tangent: float
    moving: bool
    half_resolution: bool


class Plan(NamedTuple):
    """What is drawn for a scene before any body is built: data alone."""

    name: str
    people_set: str
    seed: Tuple[int, ...]
    kind: str
    people: Tuple[Any, ...]  # PersonSpec
    view: View
    light_name: str
    light: Light
    exposure: Exposure
    room_seed: int


def plan_scene(people_set: str, index: int, special: str = '', again: int = 0) -> Plan:
    """Draw a scene of a set, or a special one; kinds and sensors take turns, so that each set has all of them.

    again: how many draws of this scene had no arrangement; the next sub-seed is taken.
    """
    garments = people_set if people_set in ('tune', 'report') else 'tune'
    seed = (SETS[people_set], SPECIAL.get(special, 0) + index, *([again] if again else []))
    rng, kind = np.random.default_rng(seed), special or KINDS[index % len(KINDS)]
    sensor = sorted(SENSORS)[(index if special else index + index // len(KINDS)) % len(SENSORS)]
    least, most = COUNTS.get(kind, (1, 3))
    count, adults = int(rng.integers(least, most + 1)), ADULTS.get(kind, 0)
    people = tuple(random_person(rng, garments, False if k < adults else None) for k in range(count))
    light_name, view = LIGHTS[int(rng.integers(0, 3))], plan_view(rng, sensor)
    if special:
        view = view._replace(moving=False, height=0.5 * view.height + 0.8)
    if special == 'stage' and view.half_resolution:
        view = view._replace(intrinsics=SENSORS[sensor].intrinsics, half_resolution=False)
    if people_set == 'committed' and not view.half_resolution:  # small files
        view = view._replace(intrinsics=view.intrinsics.halved(), half_resolution=True)
    if kind in ('lie', 'kneel'):  # a low camera would hardly see a person on the floor
        view = view._replace(height=0.5 * view.height + 1.1)
    return Plan(f'{kind}_{index}' if special else f'{index:02d}_{kind}', people_set, seed, kind, people, view,
                light_name, *plan_light(rng, light_name), room_seed=int(rng.integers(1 << 30)))


def plan_view(rng: np.random.Generator, sensor: str) -> View:
    """Draw a camera: its own intrinsics within 1.5 %, 0.4 to 2.2 m high."""
    intrinsics, half = own_intrinsics(rng, sensor), bool(rng.random() < 0.3)
    return View(sensor, intrinsics.halved() if half else intrinsics, rng.uniform(0.4, 2.2),
                intrinsics.width / 2 / intrinsics.fx, bool(rng.random() < 0.25), half)


def own_intrinsics(rng: np.random.Generator, sensor: str) -> Intrinsics:
    """Draw the intrinsics of a camera with a sensor."""
    base = SENSORS[sensor].intrinsics
    focal = base.fx * rng.uniform(0.985, 1.015)
    return base._replace(fx=focal, fy=focal, cx=base.cx + rng.uniform(-4, 4), cy=base.cy + rng.uniform(-4, 4))


def plan_light(rng: np.random.Generator, name: str) -> Tuple[Light, Exposure]:
    """Draw a light: dim ones with more noise, from above, front or a side."""
    brightness, gain = {'dim': (rng.uniform(0.38, 0.6), rng.uniform(2.0, 3.5)),
                        'normal': (rng.uniform(0.75, 1.1), rng.uniform(0.8, 1.4)),
                        'bright': (rng.uniform(1.2, 1.5), rng.uniform(0.6, 1.0))}[name]
    warm = rng.uniform(-0.10, 0.10)
    light = Light(direction=(rng.uniform(-0.7, 0.7), rng.uniform(-0.9, 0.1), rng.uniform(0.7, 1.0)),
                  ambient=rng.uniform(0.35, 0.55), sun=rng.uniform(0.35, 0.7),
                  tint=(1 + warm, 1 + rng.uniform(-0.02, 0.02), 1 - warm))
    return light, Exposure(brightness, gain)


def describe(plan: Plan) -> Dict[str, Any]:
    """Return what results are split by."""
    return {'set': plan.people_set, 'kind': plan.kind, 'light': plan.light_name, 'camera_moves': plan.view.moving,
                'half_resolution': plan.view.half_resolution, 'brightness': round(plan.exposure.brightness, 3)}
