"""The topics that the extractor reads, and the line that starts their driver."""
import pytest

from skeleton_extract_3d.node_params import ExtractorParams
from skeleton_extract_3d.ros.camera_inputs import InputTopics, input_topics


def test_without_a_camera_all_topics_are_private():
    assert input_topics(ExtractorParams(camera=''), '') == InputTopics()


@pytest.mark.parametrize('ns, one_of_several, image, namespace', [
    ('camera', '', '/camera/color/image_raw', 'camera'), ('front', '', '/front/color/image_raw', 'front'),
    ('camera', 'left', 'color/image_raw', 'left')])
def test_the_driver_is_started_in_the_namespace_of_the_topics(ns, one_of_several, image, namespace):
    params = ExtractorParams(camera='realsense', camera_ns=ns, points_source='depth_image')
    topics = input_topics(params, one_of_several)
    assert topics.image == image
    assert topics.driver_line.startswith('roslaunch realsense2_camera ')
    assert (f'camera:={namespace}' in topics.driver_line) == (namespace != 'camera')
