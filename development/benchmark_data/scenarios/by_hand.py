"""Scenarios by hand: people who wave, turn, cross, stand in groups and behind furniture."""
import zlib
from typing import Any, Dict, List, Optional, Sequence, Tuple

from ..people.geometry import heading
from ..people.motion import Motion, MotionKeys
from ..rendering.camera import Camera
from ..rendering.depth_sensors import KinectV2
from ..rendering.renderer import Light
from ..rendering.room import Room
from ..sequence import Scene, fixed
from .cast import rig

Member = Tuple[str, Any, Any, int, Dict[str, Any]]  # name, path, yaw, seed, further key frames


def camera(height: float, pitch: float, **place: float) -> Camera:
    """Return a Kinect v2 at a height [m] with a pitch down [deg]."""
    return Camera(KinectV2.intrinsics, height, pitch, **place)


def members(cast: Sequence[Member]) -> Tuple[List[Any], List[Any]]:
    """Return rigs and motions of people who walk and stand."""
    rigs = [rig(name) for name, *_ in cast]
    return rigs, [Motion(person, MotionKeys(path, yaw, **keys), seed)
                  for person, (_, path, yaw, seed, keys) in zip(rigs, cast)]


def scene(name: str, room: Room, people: Tuple[List[Any], List[Any]], view: Optional[Camera] = None, **options: Any
          ) -> Scene:
    """Return a scene with its light from a direction (option towards_light)."""
    light = Light(options.pop('towards_light'))
    cameras = options.pop('cameras', [fixed(view)])
    return Scene(name, zlib.crc32(name.encode()) >> 4, room, *people, cameras, light=light, **options)


def wave() -> Scene:
    right = [(0, 'down'), (0.45, 'wave_in'), (0.7, 'wave_out'), (0.95, 'wave_in'), (1.2, 'wave_out'),
             (1.7, 'point_fwdside'), (2.1, 'chest'), (2.6, 'chest'), (3, 'open')]
    left = [(0, 'down'), (0.9, 'down'), (1.4, 'point_side'), (1.75, 'point_side'), (2.2, 'chest'), (2.6, 'chest_low'),
            (3, 'open')]
    return scene('wave', Room(11, 5.2), members([
        ('adam', [(0, (0.05, 2.45))], [(0, 4), (1.5, -6), (3, 3)], 1,
         {'arms': {'R': right, 'L': left}, 'head_yaw': [(0, 0), (1.4, 18), (2, 0)],
          'twist': [(0, 0), (1.4, 6), (2.2, 0)]})]),
        camera(1.3, 6), towards_light=(-0.3, -0.7, 0.9))


def turn() -> Scene:
    arms = {'R': [(0, 'down'), (1.25, 'down'), (1.7, 'bent'), (2.8, 'bent_up')],
                'L': [(0, 'down'), (1.25, 'down2'), (1.7, 'bent'), (2.8, 'chest_low')]}
    return scene('turn', Room(12, 5.6, -3.1, 2.9), members([
        ('bea', [(0, (0, 2.55))], [(0, 0), (1.4, 175), (2.8, 362)], 3,
         {'arms': arms, 'head_yaw': [(0, 14), (1.4, 12), (2.6, 0)]})]), camera(1.45, 9), towards_light=(0.1, -0.9, 0.9))


def cross() -> Scene:
    return scene('cross', Room(13, 5.6), members([
        ('bea', [(0, (-1.85, 3.75)), (1.2, (-0.16, 3.68)), (1.75, (0.0, 3.67)), (2.8, (1.5, 3.6))],
         [(0, heading(3.6, -0.2))], 5, {'head_yaw': [(0, 0), (1, -25), (2, 0)]}),
        ('ed', [(0, (1.05, 2.55)), (1.0, (0.08, 1.98)), (1.7, (-0.08, 1.9)), (2.7, (-1.1, 2.25))],
         [(0, -52), (0.8, -18), (1.6, -22), (2.2, heading(-1, 0.3))], 6, {})]), camera(1.35, 5),
        towards_light=(-0.2, -0.8, 0.9))


def group() -> Scene:
    return scene('group', Room(14, 6.2, -3.6, 3.6), members([
        ('carl', [(0, (-1.25, 2.6))], [(0, 48), (2.7, 62)], 9, {'arms': {
            'R': [(0, 'bent'), (0.6, 'lowwave_out'), (1.1, 'lowwave_in'), (1.6, 'lowwave_out'), (2.2, 'bent_up')],
            'L': [(0, 'bent'), (1.2, 'open'), (2.4, 'chest_low')]}}),
        ('dora', [(0, (-0.05, 3.3)), (2.7, (0.15, 3.2))], [(0, -10), (2.7, 12)], 10, {
            'arms': {'R': [(0, 'cross'), (1.5, 'cross'), (2.1, 'chin')], 'L': [(0, 'cross')]},
            'head_yaw': [(0, 20), (1.5, -20)]}),
        ('adam', [(0, (1.72, 2.0))], [(0, -55), (2.7, -40)], 11, {'arms': {
            'R': [(0, 'down'), (0.8, 'point_fwd'), (1.5, 'point_fwd'), (2.2, 'bent')], 'L': [(0, 'hip')]}}),
        ('ed', [(0, (-1.9, 4.7)), (2.7, (0.9, 4.6))], [(0, heading(1, -0.05))], 12, {})]), camera(1.5, 8),
        towards_light=(-0.25, -0.8, 0.9))


def furniture() -> Scene:
    room = Room(15, 5.4)
    room.table(-0.35, 2.35, (1.7, 0.6, 0.92), solid=True)
    room.things_on_table(-0.35, 2.35, (1.7, 0.6, 0.92), 0, 7)
    path = [(0, (-0.75, 2.98)), (0.5, (-0.7, 2.98)), (1.3, (0.25, 3.0)), (2.1, (1.05, 2.6)), (2.8, (1.15, 1.95))]
    return scene('furniture', room, members([
        ('carl', path, [(0, 5), (0.4, 10), (0.9, 80), (1.5, 70), (2.1, 15), (2.8, 3)], 17, {'arms': {
            'R': [(0, 'chest_low'), (0.5, 'bent'), (1.1, 'down')], 'L': [(0, 'open'), (0.5, 'bent'), (1.1, 'down')]}}),
        ('dora', [(0, (-0.05, 3.55))], [(0, -20), (2.8, 15)], 18, {'arms': {
            'R': [(0, 'bent'), (1.0, 'phone'), (2.6, 'phone')], 'L': [(0, 'cross')]}})]), camera(1.4, 7),
        towards_light=(-0.3, -0.6, 0.9))


def crowd() -> Scene:
    """Eight people at 2.3 to 6.5 m; adam (1) and finn (3) wear alike clothes."""
    return scene('crowd', Room(31, 7.6, -4.2, 4.0), members([
        ('adam', [(0, (-1.25, 2.55))], [(0, 35), (2.7, 20)], 40, {'arms': {
            'R': [(0, 'bent'), (0.8, 'open'), (1.6, 'bent_up'), (2.4, 'chest')]}}),
        ('bea', [(0, (0.85, 2.75))], [(0, -35), (2.7, -20)], 41, {'arms': {
            'L': [(0, 'bent'), (1.1, 'bent_up'), (2.2, 'open')], 'R': [(0, 'hip')]}}),
        ('finn', [(0, (-2.55, 4.25)), (2.6, (0.75, 4.0))], [(0, heading(3.3, -0.25))], 42, {}),
        ('ed', [(0, (1.62, 3.55))], [(0, -60), (2.7, -75)], 43, {'arms': {
            'R': [(0, 'cross'), (1.4, 'chin'), (2.5, 'cross')], 'L': [(0, 'cross')]}}),
        ('carl', [(0, (0.05, 4.95)), (2.6, (0.2, 4.9))], [(0, -8), (2.6, 14)], 44, {'arms': {'R': [(0, 'phone')]}}),
        ('dora', [(0, (2.95, 5.5)), (2.6, (-0.3, 5.75))], [(0, heading(-3.2, 0.2))], 45, {}),
        ('gil', [(0, (-0.75, 6.45)), (2.6, (-0.85, 4.95))], [(0, heading(-0.1, -1.5))], 46, {'arms': {
            'L': [(0, 'down'), (1.5, 'down'), (2.1, 'bent_up')]}}),
        ('hana', [(0, (-2.5, 3.45))], [(0, 70), (2.7, 50)], 47, {'arms': {
            'R': [(0, 'down'), (0.9, 'point_fwd'), (1.7, 'point_fwd'), (2.4, 'bent')], 'L': [(0, 'bent')]}})]),
        camera(1.62, 8), towards_light=(-0.25, -0.8, 0.95), frames=36)
