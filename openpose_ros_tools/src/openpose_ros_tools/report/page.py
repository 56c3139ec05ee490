"""The report of a recording as one page of HTML that needs nothing else: no network, no script, images within it."""
import base64
from html import escape
from string import Template
from typing import Dict, Iterable, List, Mapping, Sequence

import numpy as np

from openpose_ros_signals.records import UNKNOWN
from openpose_ros_tools.plots.plotting import joint_title
from openpose_ros_tools.report.crops import Thumbnail
from openpose_ros_tools.report.facts import PersonFacts, ReportFacts
from openpose_ros_tools.tables.signal_timeline import GESTURE, POSTURE, SignalTimeline, Span

# Gestures of a page: the surest ones; a recording of hours may have more.
MOST_GESTURES = 500
_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
:root { color-scheme: light dark; --text: #1b1b1b; --back: #fff; --line: #ddd; --soft: #666; --note: #fff6dd; }
@media (prefers-color-scheme: dark) {
  :root { --text: #e6e6e6; --back: #17181a; --line: #3a3c40; --soft: #a0a0a0; --note: #3a331c; } }
body { font: 15px/1.45 system-ui, sans-serif; color: var(--text); background: var(--back); max-width: 72rem;
  margin: 0 auto; padding: 1rem; }
h1 { font-size: 1.5rem; overflow-wrap: anywhere; margin-bottom: .2rem; }
h2 { font-size: 1.15rem; margin: 1.8rem 0 .5rem; border-bottom: 1px solid var(--line); }
.soft, figcaption { color: var(--soft); font-size: .9em; }
.note { background: var(--note); padding: .4rem .7rem; border-radius: .3rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { text-align: left; padding: .2rem .8rem .2rem 0; border-bottom: 1px solid var(--line); vertical-align: top; }
th { font-weight: 600; color: var(--soft); }
.plot { width: 100%; height: auto; }
.plot.top_view, .plot.image_paths { max-width: 46rem; }
.plot { background: #fff; border-radius: .3rem; }
.dot { display: inline-block; width: .8em; height: .8em; border-radius: 50%; margin-right: .4em; }
figure { margin: 0; }
.crops { display: flex; flex-wrap: wrap; gap: .8rem; }
.crops img { height: 11rem; max-width: 100%; display: block; border-radius: .3rem; }
@media print { body { max-width: none; padding: 0; } .wide { overflow: visible; } tr, figure { break-inside: avoid; }
  body, :root { --text: #000; --back: #fff; --soft: #444; --line: #bbb; --note: #f4f4f4; } }
</style>
</head>
<body>
<h1>$title</h1>
$content
</body>
</html>
""")
_PLOTS = {'signals': 'What they did', 'top_view': 'Ways', 'image_paths': 'Ways in the image'}


def page(facts: ReportFacts, plots: Mapping[str, bytes], thumbnails: Sequence[Thumbnail] = ()) -> str:
    """Return the page.

    Args:
        plots: SVG by name, of those that `_PLOTS` names.
        thumbnails: crops of people.
    """
    parts = [_summary(facts), *(f'<p class="note">{escape(note)}</p>' for note in facts.notes)]
    if facts.people:
        parts.append(_people(facts.people))
    if thumbnails and facts.selection:
        parts.append(_crops(thumbnails, facts.selection.begin))
    parts += [_section(title, _plot(name, plots[name])) for name, title in _PLOTS.items() if name in plots]
    if facts.timeline is not None and facts.selection is not None:
        begin = facts.selection.begin * 1e-9
        parts += [_postures(facts.timeline, facts.people or ()), _gestures(facts.timeline, begin),
                  _falls(facts.timeline, begin)]
    parts.append(_topics(facts))
    return _PAGE.substitute(title=escape(facts.recording.name), content='\n'.join(parts))


def _summary(facts: ReportFacts) -> str:
    recording = facts.recording
    told = [f'begins at {recording.begin}', f'{recording.duration:.1f} s', f'{recording.size / 1e6:.1f} MB']
    if facts.frames:
        told.append(f'{facts.frames} frames'
                    + ('' if facts.empty is None else f', {facts.empty} of them without people'))
    if facts.people is not None:
        told.append(f'{len(facts.people)} {"person" if len(facts.people) == 1 else "people"}')
    return f'<p class="soft">{escape(" · ".join(told))}</p>'


def _people(people: Iterable[PersonFacts]) -> str:
    rows = [[_dot(each.colour) + str(each.person), _seconds(each.begin), _seconds(each.end), _seconds(each.seen),
             str(each.frames), f'{each.joints:.1f}', _percent(each.measured), _percent(each.inferred),
             _stature(each), _seconds(each.walked)] for each in people]
    return _section('People', _table(('id', 'from [s]', 'to [s]', 'seen [s]', 'frames', 'joints', 'measured',
                                      'inferred', 'stature [m]', 'walked [s]'), rows)
                    + '<p class="soft">Times are since the first frame. Joints: the mean number that is known, and '
                      'which share of these was measured or inferred. Stature: by the lengths of the measured bones, '
                      'the median and the range from the 10th to the 90th percentile.</p>')


def _stature(person: PersonFacts) -> str:
    low, high = person.stature_range
    return 'unknown' if np.isnan(person.stature) else f'{person.stature:.2f} ({low:.2f} to {high:.2f})'


def _crops(thumbnails: Sequence[Thumbnail], begin: int) -> str:
    figures = [f'<figure><img alt="person {each.person}" src="data:image/jpeg;base64,{_base64(each.jpeg)}">'
               f'<figcaption>person {each.person}, {1e-9 * (each.stamp - begin):.1f} s</figcaption></figure>'
               for each in sorted(thumbnails, key=lambda each: (each.person, each.stamp)) if each.jpeg]
    return _section('Who is who', f'<div class="crops">{"".join(figures)}</div>')


def _plot(name: str, svg: bytes) -> str:
    return (f'<figure><img class="plot {name}" alt="{escape(_PLOTS[name])}" '
            f'src="data:image/svg+xml;base64,{_base64(svg)}"></figure>')


def _postures(timeline: SignalTimeline, people: Iterable[PersonFacts]) -> str:
    """Return how long each person had which posture."""
    rows = []
    for each in people:
        times: Dict[str, float] = {}
        for span in timeline.of(POSTURE, each.person):
            times[span.name] = times.get(span.name, 0.0) + span.end - span.begin
        names = sorted(times, key=lambda name: (name == UNKNOWN, -times[name]))
        rows.append([_dot(each.colour) + str(each.person),
                     escape(', '.join(f'{joint_title(name)} {times[name]:.1f} s' for name in names))])
    return _section('Postures', _table(('id', 'time'), rows))


def _gestures(timeline: SignalTimeline, begin: float) -> str:
    spans = timeline.of(GESTURE)
    shown = sorted(sorted(spans, key=lambda span: -span.confidence)[:MOST_GESTURES], key=lambda span: span.begin)
    rows = [[str(span.person), escape(joint_title(span.name)), escape(span.arm), _seconds(span.begin - begin),
             _seconds(span.end - begin), f'{span.confidence:.2f}', escape(_aim(span))] for span in shown]
    left_out = f'<p class="soft">The {len(shown)} surest of {len(spans)}.</p>' if len(shown) < len(spans) else ''
    return _section('Gestures', (_table(('id', 'gesture', 'arm', 'from [s]', 'to [s]', 'confidence', 'points at'), rows)
                                 if rows else '<p>No gestures.</p>') + left_out)


def _aim(span: Span) -> str:
    """Return what somebody points at, or else in which direction."""
    ray = span.pointing
    if ray is None:
        return ''
    if ray.hit is not None:
        place = ', '.join(f'{value:.2f}' for value in ray.hit.position)
        return f'{ray.hit.name or "a surface"} at ({place}) m'
    return 'along ({})'.format(', '.join(f'{value:.2f}' for value in ray.direction))


def _falls(timeline: SignalTimeline, begin: float) -> str:
    rows = [[str(person), _seconds(fall.stamp - begin), f'{fall.duration:.2f}', f'{fall.speed:.1f}']
            for person, fall in timeline.falls]
    return _section('Falls', _table(('id', 'lies from [s]', 'time of the fall [s]', 'greatest speed [m/s]'), rows)
                    if rows else '<p>Nobody fell.</p>')


def _topics(facts: ReportFacts) -> str:
    return _section('Topics', _table(('topic', 'type', 'messages', 'rate [Hz]'), [
        [escape(topic.name), escape(topic.kind), str(topic.messages), f'{topic.rate:.1f}']
        for topic in facts.recording.topics]))


def _section(title: str, content: str) -> str:
    return f'<h2>{escape(title)}</h2>\n{content}'


def _table(names: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a table; the cells are HTML."""
    lines: List[str] = [f'<tr>{"".join(f"<td>{cell}</td>" for cell in row)}</tr>' for row in rows]
    head = ''.join(f'<th scope="col">{escape(name)}</th>' for name in names)
    return '<div class="wide"><table><thead><tr>{}</tr></thead>\n<tbody>{}</tbody></table></div>'.format(
        head, '\n'.join(lines))


def _dot(colour: str) -> str:
    return f'<span class="dot" style="background:{colour}"></span>'


def _seconds(value: float) -> str:
    return f'{value:.1f}'


def _percent(value: float) -> str:
    return 'unknown' if np.isnan(value) else f'{100 * value:.0f} %'


def _base64(content: bytes) -> str:
    return base64.b64encode(content).decode()
