"""Writing RGB-D folders: names of the files, lists of stamps, description of the camera."""
import statistics
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import yaml

from openpose_ros_pkg.calibration import Calibration, calibration_text
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_tools.images.rgbd_folder import LISTS
from openpose_ros_tools.images.stamps import MAX_DIFFERENCE, SECOND, associate, seconds_text


class WrittenFile(NamedTuple):
    """An image that was written; path is None where it could not be, for the reason. rounded: greatest error [m]."""

    stream: str
    stamp: int
    stem: str
    path: Optional[Path]
    reason: str = ''
    rounded: float = 0.0


def file_stems(stamps: Dict[str, List[int]], only_pairs: bool) -> Tuple[Dict[str, Dict[int, str]], List[str]]:
    """Return by stream and stamp the names of the files, without suffix, and remarks on images without a partner.

    Args:
        stamps: by stream [ns], which differ.
        only_pairs: leave out images without a partner.
    """
    colour, depth = (sorted(stamps.get(stream, ())) for stream in LISTS)
    pairs = associate(colour, depth)
    frames: List[Dict[str, int]] = [{'colour': colour[i], 'depth': depth[j]} for i, j in pairs]
    remarks = []
    for stream, of_stream in (('colour', colour), ('depth', depth)) if colour and depth else ():
        if len(of_stream) > len(pairs):
            remarks.append(f'{len(of_stream) - len(pairs)} of {len(of_stream)} {stream} images have no partner within '
                           f'{MAX_DIFFERENCE / SECOND:g} s')
    if only_pairs and not pairs:
        raise ParameterError('no image has a partner, so --only-pairs leaves nothing')
    if not only_pairs:
        paired = {stream: {frame[stream] for frame in frames} for stream in LISTS}
        frames += [{stream: stamp} for stream, of_stream in (('colour', colour), ('depth', depth))
                   for stamp in of_stream if stamp not in paired[stream]]
    frames.sort(key=lambda frame: min(frame.values()))
    stems: Dict[str, Dict[int, str]] = {stream: {} for stream in LISTS if stamps.get(stream)}
    for number, frame in enumerate(frames):
        for stream, stamp in frame.items():
            stems[stream][stamp] = f'{number:06d}'
    return stems, remarks


def write_lists(folder: Path, files: Sequence[WrittenFile]) -> None:
    """Write rgb.txt and depth.txt."""
    for stream in {file.stream for file in files}:
        items = sorted((file.stamp, file.path) for file in files if file.stream == stream and file.path is not None)
        lines = [f'# {stream} images', '# timestamp filename',
                 *(f'{seconds_text(stamp)} {path.as_posix()}' for stamp, path in items)]
        (folder / LISTS[stream]).write_text('\n'.join(lines) + '\n')


def write_description(folder: Path, calibration: Optional[Calibration], stamps: Sequence[int], **known: Any) -> None:
    """Write camera.yaml and sequence.yaml.

    Args:
        stamps: of the colour or depth images [ns].
        known: values of sequence.yaml; None: left out.
    """
    if calibration is not None:
        (folder / 'camera.yaml').write_text(calibration_text(calibration))
    values: Dict[str, Any] = {}
    if len(stamps) > 1:
        rate = round(SECOND / statistics.median(np.diff(np.sort(np.array(stamps, np.int64))).tolist()), 3)
        if 0 < rate <= 1000:
            values['fps'] = rate
    values.update((key, value) for key, value in known.items() if value is not None)
    (folder / 'sequence.yaml').write_text(yaml.safe_dump(values, default_flow_style=None, sort_keys=False))
