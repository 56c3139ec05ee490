"""The report of a recording as one page of HTML that needs nothing else: no network, no script, images within it."""
import base64
from pathlib import Path
from typing import Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import jinja2
import numpy as np

from openpose_ros_pkg.skeletons import COCO_18
from openpose_ros_signals.geometry import stature_of
from openpose_ros_signals.records import UNKNOWN
from openpose_ros_tools.plots import keypoint_plots, signal_plots
from openpose_ros_tools.plots.plotting import figure_content, joint_title, person_colours
from openpose_ros_tools.report.crops import Thumbnail
from openpose_ros_tools.tables.keypoint_selection import Selection
from openpose_ros_tools.tables.keypoint_table import KeypointTable
from openpose_ros_tools.tables.signal_timeline import GESTURE, POSTURE, WALKING, SignalTimeline, Span
from skeleton_extract_3d.people import INFERRED, MEASURED, MISSING

# Gestures of a page: the surest ones; a recording of hours may have more.
MOST_GESTURES = 500
_TEMPLATE = Path(__file__).resolve().parents[1] / 'data' / 'report.html'
# The cells of a row of a table, as text.
_Row = List[str]


class TopicFacts(NamedTuple):
    """A topic of a recording."""

    name: str
    kind: str  # type of its messages
    messages: int
    rate: float  # [Hz] over the time of the recording


class RecordingFacts(NamedTuple):
    """A recording."""

    name: str
    size: int  # [bytes]; of a folder, all that is in it
    begin: str  # as a date, where the time is one
    duration: float  # [s]
    topics: Tuple[TopicFacts, ...]


class ReportFacts(NamedTuple):
    """All that the page of a recording shows, but crops."""

    recording: RecordingFacts  # its topics and times
    frames: Optional[int] = None  # number of frames; None: the recording holds no results
    empty: Optional[int] = None  # of frames without people; None: not known
    selection: Optional[Selection] = None  # joints of the people; None: no people were found
    timeline: Optional[SignalTimeline] = None  # their signals; None: not in space
    notes: Tuple[str, ...] = ()  # what is missing, and why


def empty_frames(selection: Selection) -> Optional[int]:
    """Return the number of frames without people; None where the recording does not tell."""
    if not selection.knows_empty_frames:
        return None
    return int((~np.isin(selection.frames, selection.all_people.stamps)).sum())


def page(facts: ReportFacts, thumbnails: Sequence[Thumbnail] = ()) -> str:
    """Return the page; thumbnails: crops of people."""
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    selection, timeline = facts.selection, facts.timeline or SignalTimeline()
    persons, begin = ((), 0) if selection is None else (selection.persons, selection.begin)
    gestures = timeline.of(GESTURE)
    surest = sorted(sorted(gestures, key=lambda span: -span.confidence)[:MOST_GESTURES], key=lambda span: span.begin)
    return environment.from_string(_TEMPLATE.read_text(encoding='utf-8')).render(
        facts=facts, summary=list(_summary(facts)), plots=list(_plots(facts)),
        colours={str(person): colour for person, colour in person_colours(persons).items()},
        people=[] if selection is None else [_person(selection, timeline, person) for person in persons],
        crops=[{'text': f'person {each.person}, {1e-9 * (each.stamp - begin):.1f} s', 'data': _base64(each.jpeg)}
               for each in sorted(thumbnails, key=lambda each: (each.person, each.stamp)) if each.jpeg],
        postures=[[str(person), _postures(timeline, person)] for person in persons],
        gestures=[_gesture(span, begin * 1e-9) for span in surest], all_gestures=len(gestures),
        falls=[[str(person), _seconds(fall.stamp - begin * 1e-9), f'{fall.duration:.2f}', f'{fall.speed:.1f}']
               for person, fall in timeline.falls],
        topics=[[topic.name, topic.kind, str(topic.messages), f'{topic.rate:.1f}'] for topic in facts.recording.topics])


def _summary(facts: ReportFacts) -> Iterator[str]:
    yield f'begins at {facts.recording.begin}'
    yield f'{facts.recording.duration:.1f} s'
    yield f'{facts.recording.size / 1e6:.1f} MB'
    if facts.frames:
        yield f'{facts.frames} frames' + ('' if facts.empty is None else f', {facts.empty} of them without people')
    if facts.frames is not None:
        number = 0 if facts.selection is None else len(facts.selection.persons)
        yield f'{number} {"person" if number == 1 else "people"}'


def _plots(facts: ReportFacts) -> Iterator[Dict[str, str]]:
    """Yield name, title and SVG of each plot."""
    if facts.selection is None:
        return
    if facts.timeline is None:
        drawn = [('image_paths', 'Paths in the image', keypoint_plots.image_paths(facts.selection))]
    else:
        drawn = [('signals', 'Postures and gestures', signal_plots.signals(facts.selection, facts.timeline)),
                 ('top_view', 'Paths', keypoint_plots.top_view(facts.selection))]
    for name, title, figure in drawn:
        yield {'name': name, 'title': title, 'data': _base64(figure_content(figure, 'svg'))}


def _person(selection: Selection, timeline: SignalTimeline, person: int) -> _Row:
    """Return times of a person, the joints that are known, stature, and time of walking."""
    rows = selection.rows_of(person)
    seconds = selection.seconds(rows.stamps)
    known = int((rows.status != MISSING).sum())
    shares = [f'{100 * (rows.status == value).sum() / known:.0f} %' if known else 'unknown'
              for value in (MEASURED, INFERRED)]
    walked = sum(span.end - span.begin for span in timeline.of(WALKING, person))
    return [str(person), _seconds(seconds[0]), _seconds(seconds[-1]), _seconds(len(rows) * selection.period),
            str(len(rows)), f'{known / len(rows):.1f}', *shares, _stature(rows), _seconds(walked)]


def _stature(rows: KeypointTable) -> str:
    """Return the median of a person's stature by its measured bones, with the 10th and 90th percentile [m]."""
    if rows.dimensions == 2:
        return 'unknown'
    columns = [rows.joints.index(joint) for joint in COCO_18.joints]
    statures = np.array([stature_of(joints, status)
                         for joints, status in zip(rows.positions[:, columns], rows.status[:, columns])])
    statures = statures[np.isfinite(statures)]
    if not len(statures):
        return 'unknown'
    low, middle, high = np.percentile(statures, (10, 50, 90))
    return f'{middle:.2f} ({low:.2f} to {high:.2f})'


def _postures(timeline: SignalTimeline, person: int) -> str:
    """Return how long a person had which posture, the longest first."""
    times: Dict[str, float] = {}
    for span in timeline.of(POSTURE, person):
        times[span.name] = times.get(span.name, 0.0) + span.end - span.begin
    return ', '.join(f'{joint_title(name)} {times[name]:.1f} s'
                     for name in sorted(times, key=lambda name: (name == UNKNOWN, -times[name])))


def _gesture(span: Span, begin: float) -> _Row:
    return [str(span.person), joint_title(span.name), span.arm, _seconds(span.begin - begin),
            _seconds(span.end - begin), f'{span.confidence:.2f}', _aim(span)]


def _aim(span: Span) -> str:
    """Return the target of pointing, or else its direction."""
    ray = span.pointing
    if ray is None:
        return ''
    if ray.hit is not None:
        return f'{ray.hit.name or "a surface"} at {_vector(ray.hit.position)} m'
    return f'along {_vector(ray.direction)}'


def _vector(values: np.ndarray) -> str:
    return '({})'.format(', '.join(f'{value:.2f}' for value in values))


def _seconds(value: float) -> str:
    return f'{value:.1f}'


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode()
