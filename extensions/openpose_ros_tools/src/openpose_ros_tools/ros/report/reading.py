"""What the report reads of a recording beside keypoints: its topics, and crops of its images, which pass one by one."""
from pathlib import Path
from typing import List, Sequence

import genpy
import numpy as np

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.convert import any_image_to_bgr
from openpose_ros_tools.report.crops import Thumbnail, choose_crops, cut
from openpose_ros_tools.report.facts import RecordingFacts, TopicFacts
from openpose_ros_tools.ros.bag_files import deserialized, end_time, open_bag, stamped_messages, topic_types
from openpose_ros_tools.ros.camera_topics import TopicFinder
from openpose_ros_tools.ros.keypoints.keypoint_bag import DIMENSIONS, choose_topic, read_keypoint_bag
from openpose_ros_tools.tables.keypoint_selection import moment_text


def recording_facts(path: Path) -> RecordingFacts:
    """Return the facts of a recording; errors as `open_bag`."""
    files = [path] if path.is_file() else [file for file in path.rglob('*') if file.is_file()]
    size = sum(file.stat().st_size for file in files)
    with open_bag(path) as bag:
        topics = bag.get_type_and_topic_info().topics
        if not any(info.message_count for info in topics.values()):
            return RecordingFacts(path.name, size, 'an unknown time, without messages', 0.0, ())
        begin = float(bag.get_start_time())
        duration = end_time(bag) - begin
    return RecordingFacts(path.name, size, moment_text(round(begin * 1e9)), duration, tuple(
        TopicFacts(name, info.msg_type, info.message_count, info.message_count / duration if duration > 0 else 0.0)
        for name, info in sorted(topics.items())))


def has_people(path: Path) -> bool:
    """Return whether there are messages with people, in space or in the image."""
    with open_bag(path) as bag:
        return not set(DIMENSIONS).isdisjoint(topic_types(bag).values())


def read_thumbnails(people: Path, images: Path, image_topic: str, persons: Sequence[int], number: int
                    ) -> List[Thumbnail]:
    """Return crops of people out of the images of a recording.

    Args:
        people: recording with keypoints in the image.
        images: recording with the images, which may be another one.
        image_topic: '': the only one of colour images, or the preferred one.
        number: of crops for each person.

    Raises:
        BadInputError: there are no keypoints in the image, or no images, or several topics come into question.
    """
    with open_bag(people) as bag:
        in_image = {name: kind for name, kind in topic_types(bag).items() if DIMENSIONS.get(kind) == 2}
        topic = choose_topic(in_image, f'{people.name}, keypoints in the image', None).name
    table = read_keypoint_bag(people, topic)
    with open_bag(images) as bag:
        finder = TopicFinder(bag)
        if not image_topic and not finder.candidates['colour']:
            raise BadInputError(f'{images.name} has no topic of colour images')
        chosen = finder.required('colour', image_topic, finder.candidates['colour'])
        # images may have been recorded at a lower rate than people
        times = {message.stamp or 0: genpy.Time(0, message.time) for message in stamped_messages(bag, [chosen])}
        there = table.select(np.isin(table.stamps, list(times)))
        found: List[Thumbnail] = []
        for stamp, crops in choose_crops(there, persons, number).items():
            for message in stamped_messages(bag, [chosen], times[stamp], times[stamp]):
                if message.stamp == stamp:
                    bgr = any_image_to_bgr(deserialized(message))
                    found += [cut(bgr, crop) for crop in crops]
                    break
    return found
