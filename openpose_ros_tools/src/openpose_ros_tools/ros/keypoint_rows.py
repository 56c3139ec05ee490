"""Turn messages with people into rows of a table and back: the only place of the tables that knows both."""
from operator import attrgetter
from typing import Any, Iterator, List, Optional, Sequence, TextIO, Tuple

import genpy
import numpy as np
from openpose_ros_msgs.msg import (
    BodypartDetection,
    BodypartDetection_3d,
    PersonDetection,
    PersonDetection_3d,
    PersonDetection_3dArray,
    PersonDetectionArray,
)
from std_msgs.msg import Header

from openpose_ros_pkg.skeletons import MESSAGE_JOINTS
from openpose_ros_tools.tables.keypoint_csv import FIELDS, MISSING_PART, KeypointCsvWriter, PersonRow, complete_status


class PersonCsvWriter:
    """Writes messages of people as CSV.

    Args:
        handle: gets the names of the columns at once.
        layout: 'original', 'extended' or 'tidy'.
        dimensions: 3 for PersonDetection_3d, 2 for PersonDetection.
        missing_joints: whether the long form (tidy) has rows for joints that are not known.
    """

    def __init__(self, handle: TextIO, layout: str, dimensions: int, missing_joints: bool = False) -> None:
        self._writer = KeypointCsvWriter(handle, layout, dimensions, missing_joints)
        self._dimensions = dimensions

    def write(self, message: Any, time: Optional[int] = None) -> int:
        """Add the people of a message, of one person or of an array; return how many they are.

        Args:
            time: for the column %time [ns]; None: the stamp of the header, as `rostopic echo -p` has it on a live
                topic. With a bag it has the time of recording.
        """
        rows = list(rows_of(message, self._dimensions, time))
        for row in rows:
            self._writer.write(row)
        return len(rows)


def rows_of(message: Any, dimensions: int, time: Optional[int] = None) -> Iterator[PersonRow]:
    """Yield the people of a message of one person, or of an array message.

    Fields are found by name: what an older or newer definition of the message lacks is not known, what it has more is
    not read.

    Args:
        dimensions: 3 for messages in space, 2 in the image.
        time: [ns]; None: the stamp of the header.
    """
    header = getattr(message, 'header', None) or Header()
    stamp = header.stamp.to_nsec()
    for person in getattr(message, 'persons', [message]):
        yield PersonRow(stamp if time is None else time, header.seq, stamp, header.frame_id,
                        person.num_people_detected, person.person_ID, _parts(person, dimensions))


def person_message(row: PersonRow, header: Header) -> genpy.Message:
    """Return the PersonDetection or PersonDetection_3d of a row."""
    if len(row.parts[0]) == len(FIELDS[2]):
        flat = {joint: BodypartDetection(*part) for joint, part in zip(MESSAGE_JOINTS, row.parts)}
        return PersonDetection(header=header, num_people_detected=row.number, person_ID=row.person, **flat)
    parts = {joint: BodypartDetection_3d(x, y, z, confidence, int(status), sigma)
             for joint, (x, y, z, confidence, status, sigma) in zip(MESSAGE_JOINTS, row.parts)}
    return PersonDetection_3d(header=header, num_people_detected=row.number, person_ID=row.person, **parts)


def array_message(persons: Sequence[genpy.Message], header: Header, pose_model: str) -> genpy.Message:
    """Return the array message of the people of a frame, at least one; velocities are not known."""
    kind = PersonDetectionArray if isinstance(persons[0], PersonDetection) else PersonDetection_3dArray
    return kind(header=header, pose_model=pose_model, persons=list(persons))


def _parts(message: Any, dimensions: int) -> List[List[float]]:
    """Return the values of the joints, (K, F), each rounded to float32 as in a message that was sent."""
    fields, missing = FIELDS[dimensions], MISSING_PART[dimensions]
    parts = [getattr(message, joint, None) for joint in MESSAGE_JOINTS]
    known: Tuple[str, ...] = tuple(field for field in fields if hasattr(message.nose, field))
    read = attrgetter(*known)
    values = np.tile(np.array(missing, np.float32), (len(parts), 1))
    there = [part is not None for part in parts]
    places = [fields.index(field) for field in known]
    values[np.ix_(there, places)] = [read(part) for part in parts if part is not None]
    if dimensions == 3 and 'status' not in known:
        complete_status(values[np.newaxis], np.zeros((1, len(parts)), bool))
    return values.tolist()
