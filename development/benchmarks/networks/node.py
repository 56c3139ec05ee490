"""The people node with stand-ins for networks of files, see `stand_ins`; started by `./run bench networks rate`.

Writes the passes of its networks to the file of the variable NETWORK_CALLS when it ends.
"""
import os
from functools import partial
from pathlib import Path
from typing import List

import openpose_ros_pkg.detect.detector
from networks.stand_ins import Call, create_stand_in, write_calls
from skeleton_extract_3d.ros import people_node

if __name__ == '__main__':
    recorded: List[Call] = []
    openpose_ros_pkg.detect.detector.create_backend = partial(create_stand_in, calls=recorded)
    try:
        people_node.main()
    finally:
        write_calls(recorded, Path(os.environ['NETWORK_CALLS']))
