"""Folders of images in the layouts sequence and tum: names of the files, lists of stamps, description of the camera."""
import statistics
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import yaml

from openpose_ros_pkg.calibration import Calibration, calibration_text
from openpose_ros_pkg.errors import ParameterError
from openpose_ros_tools.images.image_layouts import STAMPS_FILE, STREAMS, TUM_LISTS
from openpose_ros_tools.images.stamps import SECOND, associate


class WrittenFile(NamedTuple):
    """An image that was written; path is None where it could not be, for the reason. rounded: greatest error [m]."""

    stream: str
    stamp: int
    stem: str
    path: Optional[Path]
    reason: str = ''
    rounded: float = 0.0


def file_stems(stamps: Dict[str, List[int]], layout: str, max_difference: int, only_pairs: bool
               ) -> Tuple[Dict[str, Dict[int, str]], List[str]]:
    """Return by stream and stamp the names of the files, without suffix, and remarks on images without a partner.

    Args:
        stamps: by stream [ns], which differ.
        max_difference: of the images of a frame [ns].
        only_pairs: images without a partner get no name: they are left out.
    """
    ordered = {stream: sorted(of_stream) for stream, of_stream in stamps.items() if of_stream}
    main = 'colour' if 'colour' in ordered else 'depth'
    # the stamps of a frame by stream
    frames = [{main: stamp} for stamp in ordered[main]]
    remarks = []
    for stream, of_stream in ordered.items():
        if stream == main:
            continue
        pairs = associate(ordered[main], of_stream, max_difference)
        for i, j in pairs:
            frames[i][stream] = of_stream[j]
        for total, one, other in ((len(ordered[main]), main, stream), (len(of_stream), stream, main)):
            if total > len(pairs):
                remarks.append(f'{total - len(pairs)} of {total} {one} images have no {other} image within '
                               f'{max_difference / SECOND:g} s')
        paired = {j for _, j in pairs}
        frames += [{stream: stamp} for j, stamp in enumerate(of_stream) if j not in paired]
    if only_pairs and 'depth' in ordered:
        frames = [frame for frame in frames if main in frame and 'depth' in frame]
    frames.sort(key=lambda frame: [frame.get(stream, min(frame.values())) for stream in STREAMS])
    stems: Dict[str, Dict[int, str]] = {stream: {} for stream in ordered}
    for number, frame in enumerate(frames):
        for stream, stamp in frame.items():
            stems[stream][stamp] = f'{number:06d}' if layout == 'sequence' else seconds_text(stamp)
    if not any(stems.values()):
        raise ParameterError('no image has a partner, so --only-pairs leaves nothing')
    return stems, remarks


def seconds_text(stamp: int) -> str:
    """Return a stamp [ns] in seconds, with all nine digits."""
    return f'{stamp // SECOND}.{stamp % SECOND:09d}'


def write_tum_lists(folder: Path, files: Sequence[WrittenFile]) -> None:
    """Write the lists of the layout tum."""
    for stream in {file.stream for file in files}:
        items = sorted((file.stamp, file.path) for file in files if file.stream == stream and file.path is not None)
        lines = [f'# {stream} images', '# timestamp filename']
        lines += [f'{seconds_text(stamp)} {path.as_posix()}' for stamp, path in items]
        (folder / TUM_LISTS[stream][0]).write_text('\n'.join(lines) + '\n')


def write_stamps(folder: Path, files: Sequence[WrittenFile]) -> None:
    """Write the table of stamps of the layout sequence."""
    streams = [stream for stream in STREAMS if any(file.stream == stream for file in files)]
    rows: Dict[str, Dict[str, int]] = {}
    for file in files:
        if file.path is not None:
            rows.setdefault(file.stem, {})[file.stream] = file.stamp
    lines = [','.join(['frame', *(f'{stream} [ns]' for stream in streams)])]
    lines += [','.join([stem, *(str(rows[stem].get(stream, '')) for stream in streams)]) for stem in sorted(rows)]
    (folder / STAMPS_FILE).write_text('\n'.join(lines) + '\n')


def write_description(folder: Path, calibration: Optional[Calibration], stamps: Sequence[int],
                      **known: Any) -> None:
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
