"""What the extractor reads of the camera that the parameter `camera` names, or that is there."""
from dataclasses import replace
from typing import NamedTuple

from openpose_ros_pkg.params.camera_presets import CameraPreset, find_preset
from openpose_ros_pkg.ros.cameras import Camera, find_camera
from skeleton_extract_3d.node_params import ExtractorParams, ExtractorSettings


class InputTopics(NamedTuple):
    """Names of the topics that the extractor reads, and the command that starts their driver; empty: not known."""

    image: str = '~image'
    points: str = '~point_cloud'
    depth: str = '~depth_image'
    camera_info: str = '~camera_info'
    driver_line: str = ''


def settle_camera(settings: ExtractorSettings, within: str = '') -> ExtractorSettings:
    """Return settings in which no value is `auto` any more; waits for a camera where `camera` is.

    Args:
        within: namespace of the first of several cameras, in which `camera` `auto` looks.

    Raises:
        ParameterError: there is no such camera, or it has no depth.
    """
    params, transport = settings.extractor, settings.transport.image_transport
    dimensions = 2 if params.points_source == 'none' else 3
    preset, ns = (find_camera(params.camera, params.camera_ns, dimensions, within) if params.camera else
                  Camera(CameraPreset('', ''), params.camera_ns))

    def settled(given: str, of_camera: str) -> str:
        return of_camera if given == 'auto' else given

    name = params.camera if params.camera != 'auto' else preset.name
    params = replace(params, camera=name, camera_ns=ns,
                     points_source=settled(params.points_source, preset.points_source or 'point_cloud'),
                     depth_transport=settled(params.depth_transport, preset.depth_transport),
                     rectified=settled(params.rectified, str(preset.rectified).lower()))
    return replace(settings, extractor=params,
                   transport=replace(settings.transport, image_transport=settled(transport, preset.image_transport)))


def input_topics(params: ExtractorParams, one_of_several: str) -> InputTopics:
    """Return the topics of settled parameters.

    Args:
        one_of_several: namespace of one camera of several, to which its topics are relative; empty: there is one.
    """
    if not params.camera:
        return InputTopics()
    camera = Camera(find_preset(params.camera), None if one_of_several else params.camera_ns)
    privates = InputTopics()[:4]
    topics = InputTopics(*(camera.topic(role, private) for role, private in zip(InputTopics._fields, privates)))
    used = topics.image, {'point_cloud': topics.points, 'depth_image': topics.depth}.get(params.points_source, '')
    is_given = any(topic.startswith('~') for topic in used)
    return topics if is_given else topics._replace(
        driver_line=camera.preset.driver_line(one_of_several or params.camera_ns))
