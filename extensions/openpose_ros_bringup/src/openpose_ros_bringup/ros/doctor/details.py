"""What a report of a problem needs beside the findings: system, versions, topics, nodes and their parameters."""
import os
import platform
import sys
from importlib import import_module
from pathlib import Path
from typing import Iterator, List

import rospkg

import openpose_ros_pkg.networks.backends  # noqa: F401, what keeps OpenVINO from sending usage data
from openpose_ros_bringup.doctor.snapshot import Snapshot

_MODULES = ('numpy', 'cv2', 'scipy', 'openvino', 'onnxruntime')
# Variables that change what ROS and the runtimes do.
_VARIABLES = ('ROS_', 'OMP_', 'OPENPOSE_ROS_', 'DISPLAY', 'CMAKE_PREFIX_PATH')
_MOST_TEXT = 200  # of a value of a parameter


def details(seen: Snapshot) -> str:
    """Return lines about system, versions and graph."""
    lines: List[str] = []
    variables = (f'{name}={value}' for name, value in sorted(os.environ.items()) if name.startswith(_VARIABLES))
    topics = (f'{topic} ({there.kind}) by {", ".join(there.nodes)}; read by {", ".join(seen.subscribed.get(topic, []))}'
              for topic, there in sorted(seen.published.items()))
    for title, found in (('system', _system()), ('versions', _versions()), ('variables', variables),
                         ('topics', topics), ('nodes', _nodes(seen))):
        lines += ['', f'## {title}', *found]
    return '\n'.join(lines) + '\n'


def _system() -> Iterator[str]:
    for path, key in (('/etc/os-release', 'PRETTY_NAME'), ('/proc/cpuinfo', 'model name'),
                      ('/proc/meminfo', 'MemTotal')):
        text = Path(path).read_text() if Path(path).is_file() else ''
        yield next((line for line in text.splitlines() if line.startswith(key)), f'{key}: unknown')
    yield f'{os.cpu_count()} cores, load {os.getloadavg()}; {platform.platform()}; Python {sys.version.split()[0]}'


def _versions() -> Iterator[str]:
    yield f"openpose_ros_pkg {rospkg.RosPack().get_manifest('openpose_ros_pkg').version}"
    for name in _MODULES:
        try:
            yield f'{name} {import_module(name).__version__}'
        except ImportError as error:
            yield f'{name}: {error}'


def _nodes(seen: Snapshot) -> Iterator[str]:
    for node in seen.nodes:
        yield f'{node.name}: {node.text}'
        yield from (f'  {key}: {value}' for key, value in sorted(node.values.items()))
        yield from (f'  ~{key}: {str(value)[:_MOST_TEXT]}' for key, value in sorted(node.parameters.items()))
