#!/usr/bin/python3
"""Print the joints of the people in a folder of RGB-D images; no ROS is needed, neither running nor installed.

    ./run shell examples/people_without_ros.py skeleton_extract_3d/demo/cross
"""
import sys
from pathlib import Path

from skeleton_extract_3d.chain_settings import create_chain
from skeleton_extract_3d.frame import Frame
from skeleton_extract_3d.points.depth import DepthImage
from skeleton_extract_3d.points.rgbd_sequence import RgbdSequence

sequence = RgbdSequence.read(Path(sys.argv[1]))       # rgb/, depth/, camera.yaml
chain = create_chain({'mode': 'fast'})                # any parameter of config/*.yaml; loads the networks
for image in sequence:
    points = DepthImage(image.depth, sequence.camera)  # (H, W) uint16 [mm] and the intrinsics; None: 2D alone
    result = chain.update(Frame('camera', 1.0 + image.time, image.bgr, points))  # any name; stamp [s] above 0
    people = result.people_3d                         # frame of the camera: x right, y down, z forward [m]
    for person_id, xyz, sigma in zip(people.ids, people.xyz, people.sigma):
        wrist = people.skeleton.index['right_wrist']  # NaN where it is MISSING
        print(f'{image.time:.2f} s: right wrist of person {person_id} at {xyz[wrist].round(2)} m, '
              f'sigma {1000 * sigma[wrist]:.0f} mm')
