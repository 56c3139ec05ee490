"""Numbers in the report of a recording."""
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Tuple

import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.geometry import stature_of
from openpose_ros_tools.plots.plotting import person_colours
from openpose_ros_tools.tables.keypoint_selection import Selection
from openpose_ros_tools.tables.signal_timeline import SignalTimeline
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING


class TopicFacts(NamedTuple):
    """A topic of a recording."""

    name: str
    kind: str  # type of its messages
    messages: int
    rate: float  # [Hz] over the time of the recording


@dataclass(frozen=True)
class RecordingFacts:
    """A recording."""

    name: str
    size: int  # [bytes]; of a folder, all that is in it
    begin: str  # as a date, where the time is one
    duration: float  # [s]
    topics: Tuple[TopicFacts, ...]


@dataclass(frozen=True)
class PersonFacts:
    """A person of a recording."""

    person: int
    colour: str
    begin: float  # first frame [s] since the first frame of the recording
    end: float  # last frame [s]
    frames: int  # in which the person was found
    seen: float  # time of these frames [s]
    joints: float  # mean number of joints that are known in them
    measured: float  # share of these joints. In the image, all that are known are measured.
    inferred: float  # share of these joints
    stature: float  # median over the frames [m], by the lengths of measured bones; NaN: too few, or not in space
    stature_range: Tuple[float, float]  # its 10th and 90th percentile [m]
    walked: float  # time in which the person walked [s]


@dataclass(frozen=True)
class ReportFacts:
    """All that the page of a recording shows, but figures and crops."""

    recording: RecordingFacts  # its topics and times
    people: Optional[Tuple[PersonFacts, ...]] = None  # None: the recording holds no results
    selection: Optional[Selection] = None  # of their joints; None: no people were found
    timeline: Optional[SignalTimeline] = None  # their signals; None: not in space
    frames: int = 0  # number of frames; 0: not known
    empty: Optional[int] = None  # of frames without people; None: not known
    notes: Tuple[str, ...] = ()  # what is missing, and why


def empty_frames(selection: Selection) -> Optional[int]:
    """Return the number of frames without people; None where the recording does not tell."""
    if not selection.knows_empty_frames:
        return None
    return int((~np.isin(selection.frames, selection.all_people.stamps)).sum())


def people_facts(selection: Selection, timeline: Optional[SignalTimeline] = None) -> Tuple[PersonFacts, ...]:
    """Return the people of a recording in the order of their ids."""
    columns = [selection.table.joints.index(joint) for joint in COCO_18.joints]
    found: List[PersonFacts] = []
    for person, colour in person_colours(selection.persons).items():
        rows = selection.rows_of(person)
        seconds = selection.seconds(rows.stamps)
        known = int((rows.status != MISSING).sum())
        measured, inferred = ((rows.status == value).sum() / known if known else np.nan
                              for value in (MEASURED, INFERRED))
        statures = np.zeros(0) if rows.dimensions == 2 else np.array(
            [stature_of(joints, status) for joints, status in zip(rows.positions[:, columns], rows.status[:, columns])])
        statures = statures[np.isfinite(statures)]
        low, middle, high = np.percentile(statures, (10, 50, 90)) if len(statures) else (np.nan,) * 3
        walked = 0.0 if timeline is None else sum(span.end - span.begin for span in timeline.of('walking', person))
        found.append(PersonFacts(person, colour, float(seconds[0]), float(seconds[-1]), len(rows),
                                 len(rows) * selection.period, known / len(rows), float(measured), float(inferred),
                                 float(middle), (float(low), float(high)), walked))
    return tuple(found)
