"""The benchmark on MVOR, by a data set of the same form with exact keypoints."""
import json

import numpy as np

from openpose_ros_pkg.skeletons import COCO_17, COCO_18
from results import Options
from sections.mvor import TRUTH, measure
from simulated_rig import CAMERA, around, walking

TIMES = np.arange(0.5, 5.0, 0.1)


def write(folder, missing):
    """Write frames of two people; `missing`: cameras that do not see the second one."""
    room, cameras = walking(6.0, 2, seed=3), around(3, noise=0.0)
    for side in ('left', 'right'):  # arms that hang down: those that swing change their lengths
        shoulder, elbow, wrist = (COCO_18.index[f'{side}_{joint}'] for joint in ('shoulder', 'elbow', 'wrist'))
        room.joints[:, :, elbow] = room.joints[:, :, shoulder] - [0.0, 0.0, 0.27]
        room.joints[:, :, wrist] = room.joints[:, :, elbow] - [0.0, 0.0, 0.24]
    detections, truth, images = [], [], []
    root = np.vstack([np.column_stack(cameras[0].pose), [0, 0, 0, 1]])
    poses = [np.linalg.inv(root) @ np.vstack([np.column_stack(camera.pose), [0, 0, 0, 1]]) for camera in cameras]
    for frame, time in enumerate(TIMES):
        ids = [10 * frame + number for number in range(3)]
        images.append({'id': str(frame), 'images': [{'id': each} for each in ids]})
        for number, camera in enumerate(cameras):
            for person in camera.keypoints(room, time).keypoints[:1 if number in missing else 2]:
                places = person[[COCO_18.index[joint] for joint in COCO_17.joints]]
                detections.append({'image_id': ids[number], 'coco_keypoints': places.ravel().tolist(), 'score': 0.9})
        for joints in room.at(time):
            rows = np.zeros((12, 4))
            for joint, row in TRUTH.items():
                place = (joints[COCO_18.index[joint]] - cameras[0].pose[1]) @ cameras[0].pose[0]
                rows[row] = *(1000.0 * place), 2
            truth.append({'image_ids': str(frame), 'keypoints3D': rows.ravel().tolist()})
    lens = {'focallength': [500.0, 500.0], 'principalpoint': CAMERA.matrix[:2, 2].tolist(), 'imagesize': [640, 480]}
    extrinsics = [np.vstack([pose[:3] * [1, 1, 1, 1000.0], pose[3:]]).ravel().tolist() for pose in poses]
    (folder / 'openpose_kps.json').write_text(json.dumps(detections))
    (folder / 'camma_mvor_2018.json').write_text(json.dumps({
        'cameras_info': {'camParams': {'intrinsics': [lens] * 3, 'extrinsics': extrinsics}}, 'annotations3D': truth,
        'multiview_images': images}))


def test_exact_detections_find_the_people_of_two_cameras_or_more(tmp_path):
    for missing, found, views in (((), 1.0, 'three'), ((1,), 1.0, 'two'), ((1, 2), 0.5, None)):
        write(tmp_path, missing)
        figures = measure(Options(data={'mvor': tmp_path})).figures
        assert (figures['people'].value, figures['found'].value) == (2 * len(TIMES), found)
        assert figures['two_views'].value == found
        assert (figures['twice'].value, figures['others'].value) == (0, 0)
        # the fusion moves keypoints to where joints are, by up to 15 mm, and bones to the lengths of an adult
        assert views is None or figures[f'{views}_mean'].value < 25
