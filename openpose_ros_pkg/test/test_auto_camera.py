"""camera:=auto waits for a camera, and takes the one that comes."""
from openpose_ros_pkg.params.camera_presets import AUTO, read_presets
from openpose_ros_pkg.ros import cameras


def test_the_table_is_read_once_while_no_camera_is_there(monkeypatch):
    kinect2 = read_presets()['kinect2']
    published, read = iter([{}, {'/rosout': 'rosgraph_msgs/Log'}, kinect2.inputs(ns='left')]), []

    def read_again():
        read.append(1)
        return read_presets()

    monkeypatch.setattr(cameras, '_published', lambda within: next(published))
    monkeypatch.setattr(cameras, '_LOOK_PERIOD', 0.0)
    monkeypatch.setattr(cameras, 'read_presets', read_again)
    assert cameras.find_camera(AUTO, '', 3) == (kinect2, 'left')
    assert len(read) == 1
