#!/usr/bin/python3
"""Measure what pages in browsers cost: rate and latency of the chain without and with them, and their own.

The shipped sequence is played without end; pages that want people, and images at a width and rate, are opened and
closed in turn, so that whatever else the machine does hits both alike. Latency: from the stamp of the camera to the
arrival of people, in a subscriber and in the pages. Processor: of people_web_node, while pages are open.

    ./run bench web --pages 2 --rate 10 --rounds 5
"""
import argparse
import sys
import time
from pathlib import Path
from typing import Any, Dict, List, Sequence

import numpy as np
import rospy
from openpose_ros_msgs.msg import PersonDetection_3dArray

import nodes
from common import Parser, markdown, run_live
from page_client import PageClient
from session import ResultWatch, Session, wait_for

NODE = '/people_web_node'
SETTLE = 2.0  # after pages have come or gone [s]


def parse_arguments() -> argparse.Namespace:
    """Read the command line."""
    parser = Parser(__doc__)
    parser.add_argument('--pages', type=int, default=2)
    parser.add_argument('--rate', type=float, default=10.0, help='images of each page (default %(default)s) [Hz]')
    parser.add_argument('--width', type=int, default=640, help='of these; 0: none (default %(default)s) [px]')
    parser.add_argument('--cloud', action='store_true', help='pages want points, too')
    parser.add_argument('--rounds', type=int, default=5, help='without and with pages (default %(default)s)')
    parser.add_argument('--port', type=int, default=18090)
    parser.add_live(seconds=15.0, warm_up=10.0)
    return parser.parse_live()


def measure(session: Session, folder: Path, arguments: argparse.Namespace) -> Sequence[str]:
    """Print the table; return nothing that has failed."""
    config = folder / 'page.yaml'
    config.write_text(f'people_web_node: {{port: {arguments.port}}}\n')
    began = session.start('nodes', ['roslaunch', 'openpose_ros_bringup', 'demo.launch', 'web:=true',
                                    f'config:={config}', *arguments.launch])
    rospy.init_node('bench', anonymous=True, disable_signals=True)
    watch = ResultWatch(nodes.PEOPLE_3D, PersonDetection_3dArray)
    wait_for(lambda: watch.arrivals, nodes.START_TIMEOUT, 'first results', began)
    time.sleep(arguments.warm_up)
    node = nodes.node_process(NODE)
    rates: Dict[bool, List[float]] = {False: [], True: []}
    latencies: Dict[bool, List[float]] = {False: [], True: []}
    processor, memory, in_pages, images, image_rates = [], [], [], [], []
    for _ in range(arguments.rounds):
        for with_pages in rates:
            pages = open_pages(arguments, in_pages, images) if with_pages else []
            time.sleep(SETTLE)
            node.cpu_percent()
            first, begin, seen = len(watch.arrivals), time.monotonic(), len(images)
            time.sleep(arguments.seconds)
            seconds = time.monotonic() - begin
            rates[with_pages].append((len(watch.arrivals) - first) / seconds)
            latencies[with_pages] += watch.latencies[first:]
            if with_pages:
                processor.append(node.cpu_percent())
                memory.append(node.memory_full_info().uss / 1e6)
                image_rates.append((len(images) - seen) / seconds / len(pages))
            for page in pages:
                page.close()
            time.sleep(SETTLE)
    rows = [['', 'chain [Hz]', 'latency median / 95 % [ms]', 'pages, median / 95 % [ms]', 'images [Hz]',
             'processor [%]', 'own memory [MB]']]
    for with_pages, rate in rates.items():
        own = [nodes.median_and_95(in_pages), f'{np.mean(image_rates):.1f}', f'{np.mean(processor):.1f}',
               f'{np.max(memory):.0f}'] if with_pages else ['-'] * 4
        rows.append([f'{arguments.pages} pages' if with_pages else 'no page',
                     f'{np.mean(rate):.2f}', nodes.median_and_95(latencies[with_pages]), *own])
    print(markdown(rows))
    return []


def open_pages(arguments: argparse.Namespace, latencies: List[float], images: List[Any]) -> List[PageClient]:
    """Return pages that note the latency of people [s], and each image."""
    def keep(message: Any, arrival: float) -> None:
        if isinstance(message, bytes):
            images.append(message[0])
        elif message['type'] == 'people':
            latencies.append(arrival - message['stamp'])

    image = {'width': arguments.width, 'rate': arguments.rate}
    return [PageClient(arguments.port, {'image': image, 'cloud': arguments.cloud}, keep)
            for _ in range(arguments.pages)]


if __name__ == '__main__':
    sys.exit(run_live(measure, parse_arguments()))
