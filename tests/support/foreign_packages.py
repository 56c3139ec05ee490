"""Message packages of other projects, as Python packages that tests write: none of them is installed everywhere.

The fields are those of people_msgs 1.4.0 (BSD), spencer_tracking_msgs 1.3.1 (BSD) and vision_msgs 0.0.2 for ROS noetic
(Apache-2.0), without their comments.
"""
from pathlib import Path
from typing import Dict, Mapping

import genpy.generator
import rospkg
from genpy.generate_initpy import write_modules

DEFINITIONS: Dict[str, Dict[str, str]] = {
    'people_msgs': {
        'Person': 'string name\ngeometry_msgs/Point position\ngeometry_msgs/Point velocity\nfloat64 reliability\n'
                  'string[] tagnames\nstring[] tags',
        'People': 'std_msgs/Header header\npeople_msgs/Person[] people'},
    'spencer_tracking_msgs': {
        'TrackedPerson': 'uint64 track_id\nbool is_occluded\nbool is_matched\nuint64 detection_id\nduration age\n'
                         'geometry_msgs/PoseWithCovariance pose\ngeometry_msgs/TwistWithCovariance twist',
        'TrackedPersons': 'Header header\nTrackedPerson[] tracks'},
    'vision_msgs': {
        'ObjectHypothesisWithPose': 'int64 id\nfloat64 score\ngeometry_msgs/PoseWithCovariance pose',
        'BoundingBox2D': 'geometry_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y',
        'BoundingBox3D': 'geometry_msgs/Pose center\ngeometry_msgs/Vector3 size',
        'Detection2D': 'Header header\nObjectHypothesisWithPose[] results\nBoundingBox2D bbox\n'
                       'sensor_msgs/Image source_img',
        'Detection3D': 'Header header\nObjectHypothesisWithPose[] results\nBoundingBox3D bbox\n'
                       'sensor_msgs/PointCloud2 source_cloud',
        'Detection2DArray': 'Header header\nDetection2D[] detections',
        'Detection3DArray': 'Header header\nDetection3D[] detections'}}


def write_packages(folder: Path, definitions: Mapping[str, Mapping[str, str]] = DEFINITIONS) -> None:
    """Write Python packages of these messages into a folder, for PYTHONPATH."""
    found = rospkg.RosPack()
    search = {name: [f'{found.get_path(name)}/msg'] for name in ('std_msgs', 'geometry_msgs', 'sensor_msgs')}
    for package, messages in definitions.items():
        sources = folder / 'definitions' / package
        sources.mkdir(parents=True)
        for name, text in messages.items():
            (sources / f'{name}.msg').write_text(text)
        search[package] = [str(sources)]
        modules = folder / package / 'msg'
        generator = genpy.generator.MsgGenerator()
        failed = generator.generate_messages(package, [str(sources / f'{name}.msg') for name in messages], str(modules),
                                             search)
        assert not failed
        write_modules(str(modules))
        (folder / package / '__init__.py').touch()
