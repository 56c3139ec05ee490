"""Turn CameraInfo messages into calibrations and back, with nothing lost."""
from sensor_msgs.msg import CameraInfo, RegionOfInterest
from std_msgs.msg import Header

from openpose_ros_tools.images.calibration import Calibration


def calibration_to_message(calibration: Calibration, header: Header) -> CameraInfo:
    """Return the CameraInfo of a calibration."""
    x_offset, y_offset, height, width, do_rectify = calibration.region
    return CameraInfo(header=header, width=calibration.width, height=calibration.height,
                      distortion_model=calibration.distortion_model, D=list(calibration.distortion),
                      K=list(calibration.matrix), R=list(calibration.rectification), P=list(calibration.projection),
                      binning_x=calibration.binning[0], binning_y=calibration.binning[1],
                      roi=RegionOfInterest(x_offset, y_offset, height, width, do_rectify))


def calibration_from_message(message: CameraInfo) -> Calibration:
    """Return the calibration of a CameraInfo."""
    region = message.roi
    return Calibration(message.width, message.height, message.distortion_model, tuple(message.D), tuple(message.K),
                       tuple(message.R), tuple(message.P), '', (message.binning_x, message.binning_y),
                       (region.x_offset, region.y_offset, region.height, region.width, bool(region.do_rectify)))
