"""Why no message comes on a topic, by what the ROS master knows."""
import pytest

from openpose_ros_pkg.stream.silent_topic import PublishedTopic, why_clock_stands, why_silent

IMAGE, CLOUD, TOPIC, NODE = 'sensor_msgs/Image', 'sensor_msgs/PointCloud2', '/camera/image', '/extractor'


def why(published, is_connected=True):
    topics = {topic: PublishedTopic(*values) for topic, values in published.items()}
    return why_silent(TOPIC, IMAGE, topics, is_connected, NODE)


def test_nothing_of_its_type_is_published():
    assert why({}) == f'no node publishes it; no other topic of type {IMAGE} is published'
    # what the node publishes itself is no input of its own
    assert why({'/points': (CLOUD, ['/driver']), '/drawn': (IMAGE, [NODE])}) == why({})
    # nor are results that other nodes publish
    assert why({'/openpose_ros/detected_poses_image': (IMAGE, ['/service'])}) == why({})


def test_topics_of_its_type_are_named_the_most_similar_first():
    others = {'/z': (IMAGE, ['/driver']), '/camera/rgb/image': (IMAGE, ['/driver', NODE]), '/points': (CLOUD, ['/x'])}
    assert why(others) == f'no node publishes it; other topics of type {IMAGE}: /camera/rgb/image, /z'
    many = {f'/other{number:02d}': (IMAGE, ['/driver']) for number in range(20)}
    assert why(many).endswith(f"other topics of type {IMAGE}: {', '.join(list(many)[:8])} and 12 more")


def test_a_compressed_topic_below_it_is_named():
    kind = 'sensor_msgs/CompressedImage'
    assert why({f'{TOPIC}/compressed': (kind, ['/bag'])}).startswith(
        f'no node publishes it; below it there is {TOPIC}/compressed ({kind}); no other topic')


@pytest.mark.parametrize('kind, is_connected, words', [
    (CLOUD, False, f'published as {CLOUD} by /a, /b, /c and 1 more, but read as {IMAGE}'),
    (IMAGE, False, 'published by /a, /b, /c and 1 more, but there is no connection'),
    (IMAGE, True, 'published by /a, /b, /c and 1 more, which sends nothing'),
])
def test_why_a_published_topic_is_silent(kind, is_connected, words):
    assert why({TOPIC: (kind, ['/d', '/b', '/a', '/c'])}, is_connected).startswith(words)


def test_why_simulated_time_stands_still():
    assert 'nothing comes on /clock' in why_clock_stands(0.0)
    assert 'stands still at 12.500 s' in why_clock_stands(12.5)
