"""TRC files, for OpenSim and Pose2Sim: positions of markers over time, tabs between them."""
import numpy as np

from openpose_ros_pkg.skeletons import openpose_name
from openpose_ros_tools.mocap.files import MarkerRecording

# Names of markers in Pose2Sim's models (OpenSim_Setup/Markers_Body25.xml) that are not those of the joints.
_MARKERS = {'mid_hip': 'CHip', 'head_top': 'Head'}


def marker_name(joint: str) -> str:
    """Return Pose2Sim's name of a joint: RShoulder, LBigToe, CHip."""
    return _MARKERS.get(joint) or openpose_name(joint)


def trc_text(recording: MarkerRecording, file_name: str) -> str:
    """Return the file [m] of two samples or more at a constant rate; cells of hidden markers are empty.

    Source: OpenSim's documentation, "Marker (.trc) Files", and its TRCFileAdapter: a tab ends the lines of a table, as
    its reader takes a last empty cell without one for a missing column.
    """
    count, names, rate = len(recording), recording.names, recording.rate
    values = {'DataRate': f'{rate:.2f}', 'CameraRate': f'{rate:.2f}', 'NumFrames': count, 'NumMarkers': len(names),
              'Units': 'm', 'OrigDataRate': f'{rate:.2f}', 'OrigDataStartFrame': 1, 'OrigNumFrames': count}
    lines = [['PathFileType', '4', '(X/Y/Z)', file_name], [*values], [str(value) for value in values.values()],
             ['Frame#', 'Time', *(cell for name in names for cell in (name, '', '')), ''],
             ['', '', *(f'{axis}{number}' for number in range(1, len(names) + 1) for axis in 'XYZ'), ''], []]
    for time, positions in zip(recording.times.tolist(), recording.positions):
        lines.append([str(round(time * rate) + 1), f'{time:.6f}',  # the frame is counted from 0 s
                      *('' if np.isnan(value) else f'{value:.6f}' for value in positions.ravel()), ''])
    return ''.join('\t'.join(line) + '\n' for line in lines)
