"""The report of a recording as one page of HTML that needs nothing else: no network, no script, images within it."""
import base64
from pathlib import Path
from typing import Dict, Iterator, List, Mapping, Sequence

import jinja2
import numpy as np

from openpose_ros_signals.records import UNKNOWN
from openpose_ros_tools.plots.plotting import joint_title
from openpose_ros_tools.report.crops import Thumbnail
from openpose_ros_tools.report.facts import PersonFacts, ReportFacts
from openpose_ros_tools.tables.signal_timeline import GESTURE, POSTURE, SignalTimeline, Span

# Gestures of a page: the surest ones; a recording of hours may have more.
MOST_GESTURES = 500
_TEMPLATE = Path(__file__).resolve().parents[1] / 'data' / 'report.html'
_PLOTS = {'signals': 'Postures and gestures', 'top_view': 'Paths', 'image_paths': 'Paths in the image'}
# The cells of a row of a table, as text.
_Row = List[str]


def page(facts: ReportFacts, plots: Mapping[str, bytes], thumbnails: Sequence[Thumbnail] = ()) -> str:
    """Return the page.

    Args:
        plots: SVG by name, of those that `_PLOTS` names.
        thumbnails: crops of people.
    """
    environment = jinja2.Environment(autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True)
    people, timeline = facts.people or (), facts.timeline or SignalTimeline()
    begin = 0 if facts.selection is None else facts.selection.begin
    gestures = timeline.of(GESTURE)
    surest = sorted(sorted(gestures, key=lambda span: -span.confidence)[:MOST_GESTURES], key=lambda span: span.begin)
    return environment.from_string(_TEMPLATE.read_text(encoding='utf-8')).render(
        facts=facts, summary=list(_summary(facts)), colours={str(each.person): each.colour for each in people},
        people=[_person(each) for each in people],
        crops=[{'text': f'person {each.person}, {1e-9 * (each.stamp - begin):.1f} s', 'data': _base64(each.jpeg)}
               for each in sorted(thumbnails, key=lambda each: (each.person, each.stamp)) if each.jpeg],
        plots=[{'name': name, 'title': title, 'data': _base64(plots[name])} for name, title in _PLOTS.items()
               if name in plots],
        postures=[[str(each.person), _postures(timeline, each.person)] for each in people],
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
    if facts.people is not None:
        yield f'{len(facts.people)} {"person" if len(facts.people) == 1 else "people"}'


def _person(person: PersonFacts) -> _Row:
    low, high = person.stature_range
    stature = 'unknown' if np.isnan(person.stature) else f'{person.stature:.2f} ({low:.2f} to {high:.2f})'
    return [str(person.person), _seconds(person.begin), _seconds(person.end), _seconds(person.seen),
            str(person.frames), f'{person.joints:.1f}', _percent(person.measured), _percent(person.inferred), stature,
            _seconds(person.walked)]


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


def _percent(value: float) -> str:
    return 'unknown' if np.isnan(value) else f'{100 * value:.0f} %'


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode()
