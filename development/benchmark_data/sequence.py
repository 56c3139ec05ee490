"""A scene with people who move, rendered into folders of images and truth."""
import json
import shutil
from pathlib import Path
from typing import Any, Callable, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import cv2
import numpy as np

from . import truth
from .people.body import COCO18, FEET
from .people.hand_poses import FACE_POINTS, HAND21
from .people.held import Holder
from .people.rig import Posed, Rig
from .rendering.camera import Camera
from .rendering.color_camera import ColorCamera, Exposure
from .rendering.depth_sensors import SENSORS
from .rendering.renderer import Frame, Light, Renderer
from .rendering.room import Room

FPS = 15.0
JPEG_QUALITY, PNG_COMPRESSION = 86, 4


class Scene(NamedTuple):
    """Everything that a sequence is rendered from. movers: a Motion, Actor or Holder for each rig."""

    name: str
    seed: int
    room: Room
    rigs: Sequence[Rig]
    movers: Sequence[Any]
    cameras: Sequence[Callable[[int], Camera]]  # frame number to camera; several cameras see the same
    moving: bool = False  # whether the (only) camera moves
    sensor: str = 'kinect_v2'
    frames: int = 40
    fps: float = FPS
    light: Light = Light()
    exposure: Exposure = Exposure()
    targets: Optional[Dict[str, np.ndarray]] = None  # of pointing, world; gestures are labelled
    hands: bool = False
    description: Mapping[str, Any] = {}  # for meta.json


def fixed(camera: Camera) -> Callable[[int], Camera]:
    """Return a camera that stays where it is."""
    return lambda _i: camera


def write_scene(scene: Scene, folder: Path, only: Optional[Sequence[int]] = None) -> Path:
    """Render a scene into folder/NAME, which appears when it is complete; several cameras into cam0, cam1 ... there."""
    target, partial = folder / scene.name, folder / f'.{scene.name}.partial'
    shutil.rmtree(str(partial), ignore_errors=True)
    numbers = range(scene.frames) if only is None else only
    poses = {i: [rig.pose(mover.at(i / scene.fps)) for rig, mover in zip(scene.rigs, scene.movers)] for i in numbers}
    several = len(scene.cameras) > 1
    views = [_write_view(scene, k, poses, partial / f'cam{k}' if several else partial)
             for k in range(len(scene.cameras))]
    if several:
        _write_world(scene, views, poses, partial)
    shutil.rmtree(str(target), ignore_errors=True)
    return partial.rename(target)


def _write_view(scene: Scene, k: int, poses: Dict[int, List[Posed]], folder: Path) -> List[Dict[str, Any]]:
    """Render what a camera sees; return its frames of truth."""
    for name in ('rgb', 'depth'):
        (folder / name).mkdir(parents=True)
    view = scene.cameras[k]
    camera = view(min(poses))
    seed = scene.seed * 8 + k
    sensor = SENSORS[scene.sensor](camera.intrinsics.fx, seed)
    color_camera = ColorCamera(camera.intrinsics.height, camera.intrinsics.width, scene.exposure, seed)
    renderer = Renderer(scene.room, scene.light, seed)
    renderer.aim(camera)
    frames, camera_poses = [], []
    for i, posed in poses.items():
        if scene.moving:
            camera = view(i)
            renderer.aim(camera)
        image = renderer.frame([(rig.body, rig.vertices(person)) for rig, person in zip(scene.rigs, posed)],
                               [(mover.mesh, mover.vertices(person, i / scene.fps))
                                for mover, person in zip(scene.movers, posed) if isinstance(mover, Holder)])
        camera_poses.append(np.round(camera.pose(), 6).tolist())
        frames.append({'i': int(i), 't': round(i / scene.fps, 6),
                       'people': _people_truth(scene, camera, i, posed, image)})
        cv2.imwrite(str(folder / f'rgb/{i:03d}.jpg'), color_camera.take(image.color),
                    [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
        cv2.imwrite(str(folder / f'depth/{i:03d}.png'), sensor.measure(image),
                    [cv2.IMWRITE_PNG_COMPRESSION, PNG_COMPRESSION])
    _write_truth(scene, view(min(poses)), frames, folder)
    _write_meta(scene, (k, view(min(poses))), (frames, camera_poses), folder)
    return frames


def _people_truth(scene: Scene, camera: Camera, i: int, posed: Sequence[Posed], image: Frame) -> List[Dict[str, Any]]:
    """Return the people of a frame; one with no joint and no pixel in the image is left out."""
    people = []
    for k, (rig, mover, person) in enumerate(zip(scene.rigs, scene.movers, posed)):
        found = truth.point_truth(camera, person.joints, k + 1, image, truth.JOINT_THICKNESS)
        if max(found['vis']) == truth.OUTSIDE and not (image.ids == k + 1).any():
            continue
        feet = truth.point_truth(camera, person.feet, k + 1, image, truth.FOOT_THICKNESS)
        entry = dict(id=k + 1, **found, feet=feet)
        if scene.targets is not None:
            entry.update(truth.signal_truth(camera, mover.labels(i / scene.fps), person.joints))
        if scene.hands:
            entry['hands'] = [dict(side=side, **truth.point_truth(camera, points, k + 1, image, truth.HAND_THICKNESS))
                              for side, points in zip(('right', 'left'), rig.hand_points(person))]
            entry['face'] = truth.point_truth(camera, rig.face_points(person), k + 1, image, truth.FACE_THICKNESS)
        people.append(entry)
    return people


def _write_truth(scene: Scene, camera: Camera, frames: List[Dict[str, Any]], folder: Path) -> None:
    contents: Dict[str, Any] = {'joints': COCO18, 'feet': FEET}
    if scene.targets is not None:
        contents['targets'] = {name: {'world': np.round(place, 4).tolist(),
                                          'camera': np.round(camera.to_camera(place), 4).tolist()}
                               for name, place in scene.targets.items()}
    if scene.hands:
        contents.update(hand_joints=HAND21, face_points=FACE_POINTS)
    (folder / 'gt.json').write_text(json.dumps(dict(**contents, frames=frames)))


def _write_meta(scene: Scene, view: Tuple[int, Camera], rendered: Tuple[List[Any], List[Any]], folder: Path) -> None:
    (k, camera), (frames, camera_poses) = view, rendered
    model, people = camera.intrinsics, []
    for i, rig in enumerate(scene.rigs):
        look = {name: getattr(rig.body.spec, name) for name in ('gender', 'age', 'weight', 'outfit', 'shoes', 'hair')}
        people.append({'id': i + 1, 'stature_m': round(rig.body.stature, 3), **{
            name: value if isinstance(value, str) else round(value, 3) for name, value in look.items()}})
    meta = dict(
        K=[model.fx, 0, model.cx, 0, model.fy, model.cy, 0, 0, 1], fps=scene.fps,
        frame_id='camera_rgb_optical_frame', width=model.width, height=model.height,
        n_frames=len(frames), T_world_camera=np.round(camera.pose(), 6).tolist(),
        camera={'height_m': round(camera.height, 3), 'pitch_down_deg': round(camera.pitch, 2)}, scenario=scene.name,
        seed=scene.seed, sensor=scene.sensor, depth='uint16 mm, 0 = invalid, aligned to rgb',
        people=people,
        notes=scene.room.notes, **scene.description)
    if scene.moving:
        meta['poses'] = camera_poses
    if len(scene.cameras) > 1:
        meta['camera_name'] = f'cam{k}'
    (folder / 'meta.json').write_text(json.dumps(meta, indent=1))


def _write_world(scene: Scene, views: List[List[Dict[str, Any]]], poses: Dict[int, List[Posed]], folder: Path) -> None:
    """Write gt_world.json: all people in the world frame and how each camera sees their joints."""
    frames = []
    for row, (i, posed) in enumerate(poses.items()):
        people = []
        for k, person in enumerate(posed):
            seen = {f'cam{q}': next((entry['vis'] for entry in view[row]['people'] if entry['id'] == k + 1), [0] * 18)
                    for q, view in enumerate(views)}
            people.append({'id': k + 1, 'xyz': np.round(person.joints, 4).tolist(), 'vis': seen})
        frames.append({'i': int(i), 't': round(i / scene.fps, 6), 'people': people})
    (folder / 'gt_world.json').write_text(json.dumps({
        'joints': COCO18, 'frame_id': 'world', 'fps': scene.fps, 'cameras': [f'cam{k}' for k in range(len(views))],
        'frames': frames}))
