"""The topics of a bag, by the name of the camera that was recorded."""
from dataclasses import fields, replace
from typing import Mapping, Tuple

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.params.camera_presets import (
    AUTO,
    COMPRESSED,
    IMAGE,
    CameraPreset,
    choose_camera,
    find_preset,
)
from openpose_ros_tools.ros.bag_files import open_bag, topic_types
from openpose_ros_tools.ros.camera_topics import is_within, raw_topic
from openpose_ros_tools.ros.process_bag.job import BagJob, CameraTopics


def with_preset(job: BagJob) -> BagJob:
    """Return a job with topics and rectification of its preset; what the user has named stays.

    Raises:
        BadInputError: the bag can not be read, or has no camera that `auto` knows.
        ParameterError: there is no such preset.
    """
    if not job.preset:
        return job
    with open_bag(job.source) as bag:
        types = topic_types(bag)
    inside = job.camera if any(is_within(topic, job.camera) for topic in types if job.camera) else ''
    preset, ns = _camera_of(job, types, inside)
    only_2d = job.only_2d or preset.dimensions == 2
    topics = {role: _recorded(preset.topic(role, ns), types) for role in _roles(preset, ns, job.topics, types)}
    if only_2d:
        topics = {role: topic for role, topic in topics.items() if role == 'image' or (
            role == 'camera_info' and topic in types)}
    if inside:  # `open_camera` adds the namespace of one camera of several
        topics = {role: topic[len(inside.strip('/')) + 2:] for role, topic in topics.items()}
    named = {part.name: getattr(job.topics, part.name) for part in fields(CameraTopics)}
    topics.update({role: topic for role, topic in named.items() if topic})
    rectified = {'rectified': 'true'} if preset.rectified else {}
    return replace(job, topics=CameraTopics(**topics), only_2d=only_2d, values={**rectified, **job.values})


def _camera_of(job: BagJob, types: Mapping[str, str], inside: str) -> Tuple[CameraPreset, str]:
    """Return the preset of the camera, and the namespace of its topics."""
    if job.preset != AUTO:
        preset = find_preset(job.preset)
        return preset, inside or preset.ns
    raw = {raw_topic(topic): IMAGE if kind == COMPRESSED else kind for topic, kind in types.items()
           if not inside or is_within(topic, inside)}
    choice = choose_camera(raw, 2 if job.only_2d else 3)
    if choice.chosen is None:
        raise BadInputError(f'--camera auto: {job.source} has the topics of no camera; there is: {choice}')
    return choice.chosen.preset, choice.chosen.ns


def _roles(preset: CameraPreset, ns: str, named: CameraTopics, types: Mapping[str, str]) -> Tuple[str, ...]:
    """Return which topics of the camera are read; the depth image where the cloud was not recorded."""
    if named.in_space:
        return ('image',)
    cloud = preset.topic('points', ns)
    if preset.points_source == 'point_cloud' and (cloud in types or not preset.depth):
        return ('image', 'points')
    return ('image', 'depth', 'camera_info') if preset.depth else ('image', 'camera_info')


def _recorded(topic: str, types: Mapping[str, str]) -> str:
    """Return the topic as it was recorded, raw or compressed."""
    return next((name for name in (topic, f'{topic}/compressedDepth', f'{topic}/compressed') if name in types), topic)
