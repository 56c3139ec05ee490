"""Latency of the running nodes, by number of people."""
import itertools
import time
from pathlib import Path
from typing import Dict, List, Sequence, Tuple

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray

from camera_driver import NAMESPACE, PEOPLE_3D, make_bag, start_camera, worth_reading
from common import DEMO, on_a_master
from crowd import make_crowd
from results import Options, Section, Table
from results.machine import Unit
from results.plots import curves
from scoring.figures import Figure
from session import ResultWatch, Session, wait_for

RATES, PEOPLE, SECONDS = (15.0, 30.0), (1, 2, 5, 8), 15.0
START_TIMEOUT, WARM_UP = 240.0, 5.0  # [s]


def measure(options: Options) -> Section:
    """Measure the launched chain with depth images, mode balanced, people followed.

    What `--set` names are arguments of people.launch.
    """
    arguments = [f'{name}:={value}' for name, value in options.settings.items()]
    measured = on_a_master(watch, options.quick, arguments)
    named = {}
    for row, latencies in measured:
        name = f"at_{row['camera [Hz]']:.0f}_with_{row['people']}"
        for key, value, unit in (('median', 1e3 * np.median(latencies), 'ms'),
                                 ('late', 1e3 * np.percentile(latencies, 95), 'ms'),
                                 ('rate', row['results [Hz]'], 'Hz')):
            named[f'{name}_{key}'] = Figure(float(value), n=len(latencies), unit=unit, digits=int(unit == 'Hz'))
    people, rates = (sorted({row[column] for row, _ in measured}) for column in ('people', 'camera [Hz]'))
    lines = {f'{rate:.0f} Hz, {title}': (people, [named[f'at_{rate:.0f}_with_{count}_{key}'].value
                                                 for count in people])
             for rate in rates for key, title in (('median', 'median'), ('late', '95 %'))}
    picture = curves('latency', 'Latency by number of people, cameras of 15 and 30 Hz', lines,
                     {'x': 'people', 'y': 'latency [ms]'})
    return Section('The launched chain, mode balanced, with depth images of 960 x 540 from a camera driver, '
                   '`target_rate` that of the camera: people are followed. Latency: from the stamp of the camera to '
                   f'the arrival of the 3D message in a subscriber, {SECONDS:.0f} s a row. The people are those of the '
                   'demo, cut out and pasted, and turn back at once, where tracks are lost: more are published.', named,
                   [Table('', [[*measured[0][0]], *([*row.values()] for row, _ in measured)])], [picture])


def watch(session: Session, folder: Path, quick: bool, arguments: Sequence[str]) -> List[Tuple[
        Dict[str, object], np.ndarray]]:
    """Measure all rows and print each; return their cells, and latency [s] of each result.

    T: one f32 pass of mobilenet_thin at 656 x 368 on two threads, before and after the nodes run; latencies in T are by
    the mean of both. Start: to the first result.
    """
    rates, people, seconds = (RATES[:1], PEOPLE[:1], 5.0) if quick else (RATES, PEOPLE, SECONDS)
    rospy.init_node('latency', disable_signals=True)
    unit, measured = Unit(), []
    for rate, count in itertools.product(rates, people):
        sequence = DEMO if count == 2 else make_crowd(folder / f'crowd_{count}', [count])
        before = unit.milliseconds()
        camera = start_camera(session, make_bag(sequence, folder / 'camera.bag'), rate)
        results, began = ResultWatch(PEOPLE_3D, PersonDetection_3dArray), time.monotonic()
        nodes = session.start('nodes', [
            'roslaunch', 'openpose_ros_bringup', 'people.launch', 'signals:=false', f'target_rate:={rate}',
            f'depth:={NAMESPACE}/image_depth_rect', *arguments])
        wait_for(lambda results=results: results.arrivals, START_TIMEOUT, 'first results', nodes)
        start = time.monotonic() - began
        time.sleep(WARM_UP)
        first, begin = len(results.arrivals), time.monotonic()
        time.sleep(seconds)
        last, span = len(results.arrivals), time.monotonic() - begin
        results.stop()
        session.stop(nodes)
        session.stop(camera)
        after = unit.milliseconds()
        latencies, found = np.array(results.latencies[first:last]), np.array(results.people[first:last])
        late = 1e3 * np.percentile(latencies, (50, 95))
        row = {'camera [Hz]': rate, 'people': count, 'T [ms]': f'{before:.0f} - {after:.0f}',
               'results [Hz]': round(len(found) / span, 1),
               'latency median / 95 % [ms]': ' / '.join(f'{value:.0f}' for value in late),
               'in T': ' / '.join(f'{value:.2f}' for value in late / ((before + after) / 2)),
               'people published, mean': f'{found.mean():.1f}', 'start [s]': round(start, 1)}
        measured.append((row, latencies))
        print(' | '.join(map(str, row.values())), *worth_reading(folder / 'nodes.log'), sep='\n', flush=True)
    return measured
