"""RGB-D folders as bag_to_images writes them; `skeleton_extract_3d.points.rgbd_folder` reads them."""
import statistics
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import yaml

from openpose_ros_pkg.calibration import Calibration, calibration_text
from skeleton_extract_3d.points.rgbd_folder import LISTS
from skeleton_extract_3d.points.stamps import MAX_DIFFERENCE, SECOND, associate, seconds_text


class WrittenFile(NamedTuple):
    """An image that was written."""

    stream: str
    stamp: int  # [ns]
    path: Path  # in the folder


def number_files(folder: Path, files: Sequence[WrittenFile]) -> Tuple[List[WrittenFile], List[str]]:
    """Rename the images of a folder to the numbers of their frames.

    Returns:
        The files under their new names, and remarks on images without a partner.
    """
    colour, depth = (sorted((file for file in files if file.stream == stream), key=lambda file: file.stamp)
                     for stream in LISTS)
    frames = [[colour[i], depth[j]] for i, j in associate([file.stamp for file in colour],
                                                          [file.stamp for file in depth])]
    pairs = len(frames)
    frames += [[file] for file in sorted({*colour, *depth} - {file for frame in frames for file in frame})]
    remarks = [f'{len(of_stream) - pairs} of {len(of_stream)} {of_stream[0].stream} images have no partner within '
               f'{MAX_DIFFERENCE / SECOND:g} s' for of_stream in (colour, depth)
               if colour and depth and len(of_stream) > pairs]
    numbered = []
    for number, frame in enumerate(sorted(frames, key=lambda frame: min(file.stamp for file in frame))):
        for file in frame:
            path = file.path.with_name(f'{number:06d}{file.path.suffix}')
            (folder / file.path).rename(folder / path)
            numbered.append(file._replace(path=path))
    return numbered, remarks


def write_lists(folder: Path, files: Sequence[WrittenFile]) -> None:
    """Write rgb.txt and depth.txt."""
    for stream, name in LISTS.items():
        of_stream = sorted(file for file in files if file.stream == stream)
        if of_stream:
            lines = [f'{seconds_text(file.stamp)} {file.path.as_posix()}\n' for file in of_stream]
            (folder / name).write_text(f'# {stream} images\n# timestamp filename\n' + ''.join(lines))


def write_description(folder: Path, calibration: Optional[Calibration], files: Sequence[WrittenFile], **known: Any
                      ) -> None:
    """Write camera.yaml and sequence.yaml.

    Args:
        files: their stamps give the rate.
        known: values of sequence.yaml; None: left out.
    """
    if calibration is not None:
        (folder / 'camera.yaml').write_text(calibration_text(calibration))
    values: Dict[str, Any] = {}
    stamps = sorted(file.stamp for file in files if file.stream == files[0].stream)
    if len(stamps) > 1:
        rate = round(SECOND / statistics.median(np.diff(np.array(stamps, np.int64)).tolist()), 3)
        if 0 < rate <= 1000:
            values['fps'] = rate
    values.update((key, value) for key, value in known.items() if value is not None)
    (folder / 'sequence.yaml').write_text(yaml.safe_dump(values, default_flow_style=None, sort_keys=False))
