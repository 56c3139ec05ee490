"""What the page of a recording shows: a message of the live page's protocol per frame, spans of time and plots."""
import base64
import bisect
from dataclasses import asdict, dataclass, field
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from openpose_ros_pkg.output.draw import person_colour
from openpose_ros_pkg.skeletons import SKELETONS, SkeletonModel
from openpose_ros_tools.tables.keypoint_selection import Selection, level_axis
from openpose_ros_tools.tables.keypoint_table import people_of_rows
from openpose_ros_tools.tables.signal_timeline import SignalFrame, timeline_of
from openpose_ros_web import protocol
from openpose_ros_web.protocol import Message, Moment
from skeleton_extract_3d.points.camera import CameraModel
from skeleton_extract_3d.points.transform import TURNED, UPRIGHT, Transform

# Colours of lines on white paper are those of the people, darker.
_SHADE = 0.72
# Signals belong to a frame whose stamp is within this [s].
_TOGETHER = 1e-3


@dataclass(frozen=True)
class Recording:
    """People and what they do.

    Attributes:
        up: (3,) upwards in their frame, any length.
        landmarks: 'hands' and 'faces' that are known, by the stamp of their frame [ns].
        camera: that took the thumbnails, where the frame of the people is its own.
    """

    name: str
    moment: str  # of the first frame, as a date where it is one
    selection: Selection  # in space
    signals: Sequence[SignalFrame]
    up: np.ndarray
    notes: Tuple[str, ...] = ()
    thumbnails: Tuple[Tuple[int, bytes], ...] = ()  # stamp [ns] and JPEG
    landmarks: Mapping[int, Mapping[str, Any]] = field(default_factory=dict)
    camera: Optional[CameraModel] = None

    @property
    def frame(self) -> str:
        """Name of the page's frame, with z up."""
        return self.selection.frame_id + ('' if np.allclose(z_up(self.up)[0], np.eye(3)) else TURNED)


def facts_of(recording: Recording) -> Message:
    """Return what `www/recording.js` reads before the frames."""
    from openpose_ros_tools.plots.motion_plots import LEFT, RIGHT  # Matplotlib takes a third of the start
    selection, (spans, falls) = recording.selection, timeline_of(recording.signals)
    colours = {person: person_colour(person)[::-1] for person in selection.persons}
    begin = selection.begin * 1e-9
    return {
        'name': recording.name, 'moment': recording.moment, 'notes': list(recording.notes),
        'axis': [LEFT, RIGHT],
        'hello': protocol.hello(['camera'] if recording.thumbnails else [], 3),
        'cameras': protocol.cameras_message([(0, recording.camera, z_up(recording.up))] if recording.camera else [],
                                            recording.frame),
        'stamps': np.round(selection.seconds(selection.frames), 4).tolist(),
        'persons': [{'id': person, 'rgb': colour} for person, colour in colours.items()],
        'spans': [{**asdict(span), 'begin': round(span.begin - begin, 3), 'end': round(span.end - begin, 3)}
                  for span in spans if span.person in colours],
        'falls': [[person, round(fall.stamp - begin, 3)] for person, fall in falls if person in colours],
        'plots': _plots(recording, {person: '#' + ''.join(f'{round(_SHADE * value):02x}' for value in colour)
                                    for person, colour in colours.items()}),
        'images': [[round((stamp - selection.begin) * 1e-9, 3), base64.b64encode(
            protocol.image_message(0, stamp * 1e-9, jpeg)).decode()] for stamp, jpeg in recording.thumbnails]}


def frames_of(recording: Recording) -> Iterator[List[Message]]:
    """Yield the messages of each frame: signals, people, and hands and faces where they are known."""
    selection, pose = recording.selection, z_up(recording.up)
    table, model = selection.table, skeleton_of(selection.joints)
    signals = sorted(recording.signals, key=lambda each: each.stamp)
    times = [each.stamp for each in signals]
    order = np.argsort(table.stamps, kind='stable')
    first, last = (np.searchsorted(table.stamps[order], selection.frames, side) for side in ('left', 'right'))
    for stamp, start, end in zip(selection.frames.tolist(), first, last):
        moment = Moment(stamp * 1e-9, 0.0, stamp * 1e-9, recording.frame)
        found = bisect.bisect(times, moment.stamp - _TOGETHER)
        is_of_frame = found < len(times) and times[found] < moment.stamp + _TOGETHER
        persons = [person for person in signals[found].persons if person.id in selection.persons] if is_of_frame else []
        landmarks = recording.landmarks.get(stamp, {})
        yield [protocol.signals_message(persons, pose, moment),
               protocol.people_message(people_of_rows(table.select(order[start:end]), model), pose, moment),
               *(message(landmarks[part], pose, moment) for part, message in (
                   ('hands', protocol.hands_message), ('faces', protocol.faces_message)) if part in landmarks)]


def skeleton_of(joints: Sequence[str]) -> SkeletonModel:
    """Return the joint set that has most of these joints, and few others."""
    return max(SKELETONS.values(), key=lambda model: (len({*joints} & {*model.joints}), -len(model.joints)))


def z_up(up: np.ndarray) -> Transform:
    """Return the rotation into a frame with z upwards: none where z is up, x forward of the frame of a camera."""
    z = up / np.linalg.norm(up)
    if np.allclose(z, (0, -1, 0)):
        return UPRIGHT.T, np.zeros(3)
    x = level_axis(z, 1)
    return np.stack([x, np.cross(z, x), z]), np.zeros(3)


def _plots(recording: Recording, colours: Dict[int, str]) -> List[Dict[str, str]]:
    """Return title and SVG of each plot; colours of the people."""
    from openpose_ros_tools.plots.motion_plots import angle_plot, way_plot
    selection = recording.selection
    speeds = {}  # [m/s], over time, as the signals have them
    for person in colours:
        walks = [(stamp - selection.begin * 1e-9, np.nan if one.walk is None else one.walk.speed)
                 for stamp, persons in recording.signals for one in persons if one.id == person]
        times, values = np.array(walks, np.float64).reshape(-1, 2).T
        speeds[person] = times, values
    plots = [{'title': 'Distance and speed', 'svg': way_plot(selection, speeds, colours)}]
    plots += [{'title': f'Joint angles of person {person} [degrees], right orange, left blue',
               'svg': angle_plot(selection, person)} for person in selection.persons]
    return [plot for plot in plots if plot['svg']]
