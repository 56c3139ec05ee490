"""Keypoints in messages and bags: which topic has them, their rows for tables, and messages of rows."""
from operator import attrgetter
from pathlib import Path
from typing import Any, Iterator, List, Optional, Sequence, Tuple

import genpy
import numpy as np
import rosbag
from openpose_ros_msgs.msg import (
    BodypartDetection,
    BodypartDetection_3d,
    HandDetection,
    PersonDetection,
    PersonDetection_3d,
)
from std_msgs.msg import Header

from openpose_ros_pkg.errors import BadInputError
from openpose_ros_pkg.ros.topics import PARTS, KeypointTopic, absolute, choose_topic
from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_signals.ros.convert import signals_from_array, turned_array
from openpose_ros_tools.recording_paths import is_bag
from openpose_ros_tools.ros.bag_files import deserialized, open_bag, stamped_messages, topic_types
from openpose_ros_tools.tables.keypoint_csv import read_keypoint_csv
from openpose_ros_tools.tables.keypoint_table import (
    FIELDS,
    MISSING_PART,
    KeypointTable,
    PersonRow,
    part_values,
    table_of,
    tidy_cells,
    with_status,
)
from openpose_ros_tools.tables.long_csv import POINTS
from openpose_ros_tools.tables.signal_timeline import SignalFrame, computed_signals
from skeleton_extract_3d.points.transform import TURNED, UPRIGHT

_SIDES = {HandDetection.LEFT: 'left', HandDetection.RIGHT: 'right'}


def bag_messages(bag: rosbag.Bag, topic: str) -> Iterator[Tuple[Any, int]]:
    """Yield the messages of a topic and their time of recording [ns], in its order; BadInputError: it is damaged."""
    for stored in stamped_messages(bag, [name for name in topic_types(bag) if absolute(name) == absolute(topic)]):
        yield deserialized(stored), stored.time


def read_keypoints(path: Path, topic: Optional[str] = None) -> Tuple[KeypointTable, Optional[np.ndarray]]:
    """Read a CSV or a bag; BadInputError, if it can not be read.

    Args:
        topic: in the bag; None: see `choose_topic`.

    Returns:
        The table, and of a bag with array messages the stamps of all frames, also of those without people, (N,) int64
        [ns]; else None.
    """
    if not is_bag(path):
        if topic is not None:
            raise BadInputError(f'{path}: --topic is for bags')
        return read_keypoint_csv(path), None
    with open_bag(path) as bag:
        return keypoints_of(bag, choose_topic(topic_types(bag), str(path), topic))


def keypoints_of(bag: rosbag.Bag, topic: KeypointTopic) -> Tuple[KeypointTable, Optional[np.ndarray]]:
    """Return the table of a topic of a bag, and the stamps of all frames; see `read_keypoints`."""
    array = topic.kind if 'Array' in topic.kind else f'{topic.kind}Array'
    arrays = [name for name, kind in topic_types(bag).items()
              if kind == array and (name == topic.name or name.rpartition('/')[0] == topic.namespace)]
    stamps = [message.stamp for message in stamped_messages(bag, arrays[:1]) if message.stamp]
    rows = (row for message, time in bag_messages(bag, topic.name) for row in rows_of(message, topic.dimensions, time))
    return table_of(rows, topic.dimensions, str(bag.filename)), np.array(stamps, np.int64) if arrays else None


def signals_of(bag: rosbag.Bag, topic: KeypointTopic, table: KeypointTable, up: Optional[Sequence[float]]
               ) -> Tuple[List[SignalFrame], bool]:
    """Return the signals of people, and whether they are of the recording; else they are computed from the joints.

    Args:
        topic: of the people; their signals are beside it, as the nodes and process_bag publish them.
        table: all its people, in space.
        up: (3,) compute them, with this upwards; None: where the recording lacks them, see `computed_signals`.
    """
    kinds = {absolute(name): kind for name, kind in topic_types(bag).items()}
    signals = f'{topic.namespace}/people_signals'
    if up is not None or kinds.get(signals) not in PARTS['signals']:
        return list(computed_signals(table, up)), False
    return [SignalFrame(message.header.stamp.to_sec() or 1e-9 * time, signals_from_array(
        turned_array(message, UPRIGHT) if message.header.frame_id.endswith(TURNED) else message))
            for message, time in bag_messages(bag, signals)], True


def landmark_rows(message: Any, topic: KeypointTopic) -> Iterator[List[object]]:
    """Yield a row of each known point of the hands or faces of an array message, for a `LongCsvWriter`."""
    read = attrgetter(*FIELDS[topic.dimensions])
    for each in getattr(message, topic.part):
        side = [_SIDES.get(each.side, '')] if topic.part == 'hands' else []
        turn = getattr(each, 'orientation', None)
        orientation = [] if turn is None else [turn.x, turn.y, turn.z, turn.w, each.orientation_sigma]
        for name, point in zip(POINTS[topic.part], each.keypoints):
            cells, known = tidy_cells(read(point), topic.dimensions)
            if known:
                yield [message.header.frame_id, each.person_ID, *side, name, *cells, *orientation]


def rows_of(message: Any, dimensions: int, time: Optional[int] = None) -> Iterator[PersonRow]:
    """Yield the people of a message of one person, or of an array message, in space (3) or in the image (2).

    Fields are found by name: what another definition of the message lacks is missing, further fields are ignored.

    Args:
        time: for the column %time [ns]; None: the stamp of the header, as `rostopic echo -p` has it on a live topic.
            With a bag it has the time of recording.
    """
    header = getattr(message, 'header', None) or Header()
    stamp = header.stamp.to_nsec()
    for person in getattr(message, 'persons', [message]):
        yield PersonRow(stamp if time is None else time, header.seq, stamp, header.frame_id,
                        person.num_people_detected, person.person_ID, _parts(person, dimensions))


def person_message(row: PersonRow, header: Header) -> genpy.Message:
    """Return the PersonDetection or PersonDetection_3d of a row."""
    in_space = row.parts.shape[1] == len(FIELDS[3])
    kind, of_part = (PersonDetection_3d, BodypartDetection_3d) if in_space else (PersonDetection, BodypartDetection)
    parts = {joint: of_part(*part) for joint, part in zip(MESSAGE_JOINTS, part_values(row))}
    return kind(header=header, num_people_detected=row.number, person_ID=row.person, **parts)


def _parts(message: Any, dimensions: int) -> np.ndarray:
    """Return the values of the joints, (K, F) float32 as in a message that was sent."""
    known = [place for place, field in enumerate(FIELDS[dimensions]) if hasattr(message.nose, field)]
    read = attrgetter(*(FIELDS[dimensions][place] for place in known))
    parts = [getattr(message, joint, None) for joint in MESSAGE_JOINTS]
    values = np.tile(np.array(MISSING_PART[dimensions], np.float32), (len(parts), 1))
    values[np.ix_([part is not None for part in parts], known)] = [read(part) for part in parts if part is not None]
    if dimensions == 3 and not hasattr(message.nose, 'status'):
        values[:, 4] = np.nan
        return with_status(values)
    return values
