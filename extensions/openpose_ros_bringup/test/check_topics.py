#!/usr/bin/python3
"""All nodes run: docs/ros_api.md lists each of their topics and services with its type, and no other ones."""
import os
import re
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rosgraph
import rospy
import rosservice
import rostest

sys.path.insert(0, str(Path(__file__).resolve().parents[3] / 'tests' / 'support'))

from foreign_packages import write_packages
from session import await_true

PAGE = Path(__file__).resolve().parents[3] / 'docs/ros_api.md'
# Of roscore, rospy, roscpp and nodelets.
OWN = re.compile('/rosout|.*/(get_loggers|set_logger_level|load_nodelet|unload_nodelet|list|bond)$')
# Published when a person makes a gesture, which none in the sequence does.
OF_EVENTS = {'/humans/bodies/ID/gesture'}


def listed(section):
    """Return (name, type) of each topic in the table of a section; one type may be that of all names in a row."""
    text = PAGE.read_text().split(f'\n## {section}\n')[1].split('\n## ')[0]
    rows = [[re.findall('`(.+?)`', cell) for cell in row]
            for row in re.findall(r'^\| (`[^|]*) \| (`[^|]*) \|', text, re.MULTILINE)]
    return [pair for names, kinds in rows for pair in zip(names, kinds * (len(names) if len(kinds) == 1 else 1))]


def named(name):
    """Return the pattern of names in the graph that a name of the page stands for."""
    pattern = name.replace('NS/', 'openpose_ros(/skeleton_3d)?/').replace('/ID/', '/[^/]+/')
    start = {'~': '/.+/', '/': '/'}.get(name[0], '/(.+/)?')
    return re.compile(start + pattern.lstrip('~/') + '$')


class TopicsTest(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        rospy.init_node('check_topics')
        cls.folder = tempfile.TemporaryDirectory()
        write_packages(Path(cls.folder.name))
        path = f"{cls.folder.name}:{os.environ.get('PYTHONPATH', '')}"
        cls.launched = subprocess.Popen(['roslaunch', str(Path(__file__).with_name('topics.xml'))],
                                        env={**os.environ, 'PYTHONPATH': path})
        cls.master = rosgraph.Master(rospy.get_name())

    @classmethod
    def tearDownClass(cls):
        cls.launched.terminate()
        cls.launched.wait()
        cls.folder.cleanup()

    def compare(self, section, graph):
        """Wait until all that a section lists is in the graph, which returns {name: type}; nothing else may be."""
        rows = listed(section)
        self.assertGreater(len(rows), 3)

        def missing():
            found = graph()
            return {name for name, kind in rows if name not in OF_EVENTS and not any(
                named(name).match(other) and kind == other_kind for other, other_kind in found.items())}

        await_true(lambda: not missing(), lambda: f'listed and not there: {missing()}', 120.0)
        self.assertEqual({(name, kind) for name, kind in graph().items() if not OWN.match(name) and not any(
            named(other).match(name) and kind == other_kind for other, other_kind in rows)}, set())

    def test_topics(self):
        def graph():
            published = [name for name, nodes in self.master.getSystemState()[0] if set(nodes) - {rospy.get_name()}]
            kinds = dict(self.master.getTopicTypes())
            return {name: kinds[name].split('/')[1] for name in published}
        self.compare('Published topics', graph)

    def test_services(self):
        def graph():
            names = [name for name, _ in self.master.getSystemState()[2] if not OWN.match(name)]
            return {name: (rosservice.get_service_type(name) or '/').split('/')[1] for name in names}
        self.compare('Services', graph)


if __name__ == '__main__':
    rostest.rosrun('openpose_ros_bringup', 'check_topics', TopicsTest, sys.argv)
