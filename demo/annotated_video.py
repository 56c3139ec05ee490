"""Turn the annotated images of a bag into a video file."""
from pathlib import Path

import cv2
import rosbag

from openpose_ros_pkg.ros.convert import image_to_bgr

DEFAULT_RATE = 10.0


def write_annotated_video(bag_path: Path, video_path: Path) -> int:
    """Write every image on a topic ending in detected_poses_image, at their mean rate; return their number."""
    with rosbag.Bag(str(bag_path)) as bag:
        topics = [topic for topic in bag.get_type_and_topic_info().topics if topic.endswith('detected_poses_image')]
        stamps = [message.header.stamp.to_sec() for _, message, _ in bag.read_messages(topics=topics)] if topics else []
        if not stamps:
            return 0
        span = max(stamps) - min(stamps)
        rate = (len(stamps) - 1) / span if span > 0 else DEFAULT_RATE
        writer = None
        for _, message, _ in bag.read_messages(topics=topics):
            bgr = image_to_bgr(message)
            if writer is None:
                writer = cv2.VideoWriter(str(video_path), cv2.VideoWriter_fourcc(*'mp4v'), rate,
                                         (bgr.shape[1], bgr.shape[0]))
            writer.write(bgr)
        writer.release()
    return len(stamps)
