#!/usr/bin/python3
"""The people node, whose networks read off a chart that people are there; that for crops is one for whole bodies."""
import sys
from pathlib import Path

sys.path.append(str(Path(__file__).resolve().parents[2] / 'tests/support'))
from openpose_ros_pkg.detect import detector, recipe_choice
from openpose_ros_pkg.errors import ModelError
from openpose_ros_pkg.landmarks import detector as landmarks
from skeleton_extract_3d.ros import people_node
from whole_bodies import MODEL, PEOPLE, SIZE, networks_of


def refuse(model, *_):
    raise ModelError(f'{model.name} is not to be loaded')


if __name__ == '__main__':
    networks, find = networks_of(PEOPLE, SIZE), recipe_choice.find_model
    recipe_choice.find_model = lambda name, folder='': MODEL if name == MODEL.name else find(name, folder)
    detector.weights_path = lambda model, folder: None
    detector.create_backend = lambda model, weights, params: networks[model.name]
    landmarks.weights_path = refuse
    people_node.main()
