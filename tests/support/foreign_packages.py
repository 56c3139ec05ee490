"""Message packages of other projects, as Python packages that tests write: none of them is installed everywhere.

The fields are those of people_msgs 1.4.0 (BSD), spencer_tracking_msgs 1.3.1 (BSD), vision_msgs 0.0.2 for ROS noetic
(Apache-2.0), hri_msgs 0.9.0 (BSD), jsk_recognition_msgs 1.2.19 (BSD), moveit_msgs 0.11.4 (BSD) and what it names:
object_recognition_msgs 0.4.2 (BSD), octomap_msgs 0.3.5 (BSD), shape_msgs and trajectory_msgs 1.13.1 (BSD); and
costmap_converter 0.0.13 (BSD), without their comments.
"""
import sys
from pathlib import Path
from typing import Dict, Iterable, Mapping

import genpy.generator
import rospkg
from genpy.generate_initpy import write_modules


def _constants(names: str, first: int) -> str:
    """Return the lines of constants that count from a number on."""
    return ''.join(f'uint8 {name}={number}\n' for number, name in enumerate(names.split(), first))


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
        'Detection3DArray': 'Header header\nDetection3D[] detections'},
    'hri_msgs': {
        'IdsList': 'Header header\nstring[] ids',
        'NormalizedRegionOfInterest2D': 'Header header\nfloat32 xmin\nfloat32 ymin\nfloat32 xmax\nfloat32 ymax\n'
                                        'float32 c',
        'NormalizedPointOfInterest2D': 'float32 x\nfloat32 y\nfloat32 c',
        'Skeleton2D': 'Header header\n' + _constants(
            'NOSE NECK RIGHT_SHOULDER RIGHT_ELBOW RIGHT_WRIST LEFT_SHOULDER LEFT_ELBOW LEFT_WRIST RIGHT_HIP RIGHT_KNEE '
            'RIGHT_ANKLE LEFT_HIP LEFT_KNEE LEFT_ANKLE LEFT_EYE RIGHT_EYE LEFT_EAR RIGHT_EAR', 0)
        + 'NormalizedPointOfInterest2D[] skeleton',
        'BodyPosture': 'Header header\n' + _constants('STANDING SITTING CROUCHING LAYING', 1)
                       + 'uint8 OTHER=0\nuint8 posture',
        'Gesture': 'Header header\n' + _constants(
            'HANDS_ON_FACE ARMS_CROSSED LEFT_HAND_RAISED RIGHT_HAND_RAISED BOTH_HANDS_RAISED WAVING', 1)
        + 'uint8 OTHER=0\nuint8 gesture'},
    'jsk_recognition_msgs': {
        'PeoplePose': 'string[] limb_names\ngeometry_msgs/Pose[] poses\nfloat32[] scores',
        'PeoplePoseArray': 'Header header\njsk_recognition_msgs/PeoplePose[] poses',
        'Segment': 'geometry_msgs/Point start_point\ngeometry_msgs/Point end_point',
        'HumanSkeleton': 'std_msgs/Header header\nstring[] bone_names\njsk_recognition_msgs/Segment[] bones',
        'HumanSkeletonArray': 'std_msgs/Header header\nstd_msgs/Int32[] human_ids\n'
                              'jsk_recognition_msgs/HumanSkeleton[] skeletons'},
    'costmap_converter': {
        'ObstacleMsg': 'std_msgs/Header header\ngeometry_msgs/Polygon polygon\nfloat64 radius\nint64 id\n'
                       'geometry_msgs/Quaternion orientation\ngeometry_msgs/TwistWithCovariance velocities',
        'ObstacleArrayMsg': 'std_msgs/Header header\ncostmap_converter/ObstacleMsg[] obstacles'},
    'shape_msgs': {
        'SolidPrimitive': _constants('BOX SPHERE CYLINDER CONE', 1) + 'uint8 type\nfloat64[] dimensions\n'
                          + _constants('BOX_X BOX_Y BOX_Z', 0) + _constants('SPHERE_RADIUS', 0)
                          + _constants('CYLINDER_HEIGHT CYLINDER_RADIUS', 0) + _constants('CONE_HEIGHT CONE_RADIUS', 0),
        'MeshTriangle': 'uint32[3] vertex_indices',
        'Mesh': 'MeshTriangle[] triangles\ngeometry_msgs/Point[] vertices',
        'Plane': 'float64[4] coef'},
    'object_recognition_msgs': {'ObjectType': 'string key\nstring db'},
    'octomap_msgs': {
        'Octomap': 'Header header\nbool binary\nstring id\nfloat64 resolution\nint8[] data',
        'OctomapWithPose': 'Header header\ngeometry_msgs/Pose origin\noctomap_msgs/Octomap octomap'},
    'trajectory_msgs': {
        'JointTrajectoryPoint': 'float64[] positions\nfloat64[] velocities\nfloat64[] accelerations\n'
                                'float64[] effort\nduration time_from_start',
        'JointTrajectory': 'Header header\nstring[] joint_names\nJointTrajectoryPoint[] points'},
    'moveit_msgs': {
        'CollisionObject': 'Header header\ngeometry_msgs/Pose pose\nstring id\n'
                           'object_recognition_msgs/ObjectType type\n'
                           'shape_msgs/SolidPrimitive[] primitives\ngeometry_msgs/Pose[] primitive_poses\n'
                           'shape_msgs/Mesh[] meshes\ngeometry_msgs/Pose[] mesh_poses\nshape_msgs/Plane[] planes\n'
                           'geometry_msgs/Pose[] plane_poses\nstring[] subframe_names\n'
                           'geometry_msgs/Pose[] subframe_poses\n'
                           + _constants('ADD REMOVE APPEND MOVE', 0).replace('uint8', 'byte') + 'byte operation',
        'AttachedCollisionObject': 'string link_name\nCollisionObject object\nstring[] touch_links\n'
                                   'trajectory_msgs/JointTrajectory detach_posture\nfloat64 weight',
        'RobotState': 'sensor_msgs/JointState joint_state\nsensor_msgs/MultiDOFJointState multi_dof_joint_state\n'
                      'AttachedCollisionObject[] attached_collision_objects\nbool is_diff',
        'AllowedCollisionEntry': 'bool[] enabled',
        'AllowedCollisionMatrix': 'string[] entry_names\nAllowedCollisionEntry[] entry_values\n'
                                  'string[] default_entry_names\nbool[] default_entry_values',
        'LinkPadding': 'string link_name\nfloat64 padding',
        'LinkScale': 'string link_name\nfloat64 scale',
        'ObjectColor': 'string id\nstd_msgs/ColorRGBA color',
        'PlanningSceneWorld': 'CollisionObject[] collision_objects\noctomap_msgs/OctomapWithPose octomap',
        'PlanningScene': 'string name\nRobotState robot_state\nstring robot_model_name\n'
                         'geometry_msgs/TransformStamped[] fixed_frame_transforms\n'
                         'AllowedCollisionMatrix allowed_collision_matrix\nLinkPadding[] link_padding\n'
                         'LinkScale[] link_scale\nObjectColor[] object_colors\nPlanningSceneWorld world\nbool is_diff'}}


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
    for package, messages in definitions.items():
        modules = folder / package / 'msg'
        generator = genpy.generator.MsgGenerator()
        failed = generator.generate_messages(package, [f'{search[package][0]}/{name}.msg' for name in messages],
                                             str(modules), search)
        assert not failed
        write_modules(str(modules))
        (folder / package / '__init__.py').touch()


def forget_packages(packages: Iterable[str] = DEFINITIONS) -> None:
    """Let Python look for packages anew when they are imported again."""
    for name in [name for name in sys.modules if name.split('.')[0] in packages]:
        del sys.modules[name]
