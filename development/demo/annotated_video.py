"""Turn the annotated images of a bag into a video file."""
from pathlib import Path

import rosbag

from openpose_ros_pkg.output.recorder import DEFAULT_RATE
from openpose_ros_pkg.output.video_file import VideoFile
from openpose_ros_pkg.ros.convert import image_to_bgr


def write_annotated_video(bag_path: Path, video_path: Path) -> int:
    """Write every image on a topic ending in detected_poses_image, at their mean rate; return their number."""
    with rosbag.Bag(str(bag_path)) as bag:
        topics = [topic for topic in bag.get_type_and_topic_info().topics if topic.endswith('detected_poses_image')]
        stamps = [message.header.stamp.to_sec() for _, message, _ in bag.read_messages(topics=topics)] if topics else []
        if not stamps:
            return 0
        span = max(stamps) - min(stamps)
        rate = (len(stamps) - 1) / span if span > 0 else DEFAULT_RATE
        with VideoFile(video_path, rate) as video:
            for _, message, _ in bag.read_messages(topics=topics):
                video.write(image_to_bgr(message))
    return len(stamps)
