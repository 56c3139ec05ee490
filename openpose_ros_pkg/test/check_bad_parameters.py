#!/usr/bin/python3
"""Nodes refuse to start with wrong parameters or weights, and say what is wrong and what to do."""
import itertools
import subprocess
import sys
import tempfile
import unittest
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import rospy
import rostest
from harness import node

from openpose_ros_pkg.networks.model_registry import MOBILENET_THIN, MOVENET_MULTIPOSE
from openpose_ros_pkg.networks.models import find_weights
from session import PATIENCE, Diagnostics, await_true

WEIGHTS = 'mobilenet_thin/graph_opt.pb'
# The master keeps the parameters of a node that has ended.
NUMBERS = itertools.count()


def refusal(executable, *arguments, name=None):
    """Start a node and return its exit status and what it says; it has to end by itself."""
    name = name or f'refused_{next(NUMBERS)}'
    done = subprocess.run(['rosrun', 'openpose_ros_pkg', executable, f'__name:={name}', *arguments],
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                          timeout=PATIENCE, check=False)
    return done.returncode, done.stdout


class BadParametersTest(unittest.TestCase):

    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_bad_parameters')

    def assert_refused(self, executable, cases):
        """Start the node with each argument; it has to end with all the words that go with it."""
        with ThreadPoolExecutor(2) as pool:
            results = list(pool.map(lambda argument: refusal(executable, argument), cases))
        for words, (status, text) in zip(cases.values(), results):
            self.assertEqual(status, 1, text)
            for word in ('FATAL', *words):
                self.assertIn(word, text)
            self.assertNotIn('Traceback', text)

    def test_each_node_names_key_value_and_what_is_allowed(self):
        """All cases of the parameters are in tests/unit/params."""
        for executable, argument, words in (
                ('openpose_ros_node', '_net_input_hight:=256', (
                    "unknown parameter 'net_input_hight' = 256", "did you mean 'net_input_height'?", 'allowed:')),
                ('openpose_ros_node', '_pose_model:=NOBODY', ("'pose_model' = 'NOBODY'", 'mobilenet_thin')),
                ('openpose_ros_node_3d', '_backend:=abacus', ("'backend' = 'abacus'", "'opencv_dnn'")),
                ('openpose_ros_node_firephinx', '_service_timeout:=0.0', (
                    "'service_timeout' = 0.0", 'float in 0.1 .. 600 [s]')),
                ('camera_node', '_source:=/no/such/folder', ("'source' = '/no/such/folder'",))):
            self.assert_refused(executable, {argument: words})

    def test_what_an_earlier_start_left(self):
        """The next start says how to delete it."""
        refusal('camera_node', '_rate:=-1.0', name='twice')
        status, text = refusal('camera_node', name='twice')
        self.assertEqual(status, 1, text)
        self.assertIn("parameter 'rate' = ", text)
        self.assertIn('rosparam delete /twice/rate', text)

    def test_weights(self):
        """Missing or damaged: the text names the file and how to get it."""
        with tempfile.TemporaryDirectory() as empty, tempfile.TemporaryDirectory() as full:
            damaged = Path(full) / WEIGHTS
            damaged.parent.mkdir()
            damaged.write_bytes(b'no network')
            self.assert_refused('openpose_ros_node', {
                f'_model_folder:={empty}': ('weights of mobilenet_thin not found', f'{empty}/{WEIGHTS}',
                                            './run model get mobilenet_thin', 'without network',
                                            f'copy graph_opt.pb from there to {empty}/mobilenet_thin'),
                f'_model_folder:={full}': ('damaged', str(damaged), '10 bytes', 'sha256', './run model get')})

    def test_optional_weights_that_are_not_there_are_no_warning(self):
        """The node is well, and says in /diagnostics what it finds people without."""
        with tempfile.TemporaryDirectory() as folder:
            for model in (MOBILENET_THIN, MOVENET_MULTIPOSE):
                (Path(folder) / model.name).symlink_to(find_weights(model))
            with node('openpose_ros_node', f'_model_folder:={folder}', name='without_thunder'):
                diagnostics = Diagnostics()
                text = await_true(lambda: diagnostics.value('without_thunder', 'movenet_thunder'), 'the entry')
                self.assertEqual(diagnostics.reports('without_thunder')[-1].level, 'OK')
                self.assertIn('is not installed, so people are found less accurately', text)
                self.assertIn('./run model get movenet_thunder', text)

    def test_a_network_that_is_missing_beside_others_is_a_lasting_warning(self):
        """The node finds people without it, and /diagnostics says so as long as it lives."""
        with tempfile.TemporaryDirectory() as folder:
            weights = find_weights(MOBILENET_THIN)
            (Path(folder) / MOBILENET_THIN.name).symlink_to(weights)
            node = subprocess.Popen(['rosrun', 'openpose_ros_pkg', 'openpose_ros_node', '__name:=alone',
                                     f'_model_folder:={folder}'])
            try:
                diagnostics = Diagnostics()
                diagnostics.await_text('alone', 'is missing, so people are found less accurately, by mobilenet_thin')
                self.assertEqual(diagnostics.reports('alone')[-1].level, 'WARN')
            finally:
                node.terminate()
                node.wait(PATIENCE)


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_pkg', 'bad_parameters', BadParametersTest, sys.argv)
