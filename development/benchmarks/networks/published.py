"""The accuracy that the makers of pose networks publish, with its sources, and the plot of it against measured time."""
from typing import Dict, Mapping, NamedTuple, cast

from matplotlib.ticker import FixedLocator, FormatStrFormatter, NullLocator

from common import ROOT
from openpose_ros_pkg.networks.model_registry import MOBILENET_AP, MODELS
from openpose_ros_pkg.networks.model_types import WebArchive
from openpose_ros_tools.plots.plotting import HELP_COLOUR, PALETTE, new_figure, save_figure, tidy_axes
from results.machine import made

PLOT, TABLE = ROOT / 'docs/images/networks_time.svg', ROOT / 'development/notes/networks.md'
_RTMPOSE = 'mmpose, projects/rtmpose/README.md, "Body 17 Keypoints", trained on Body8 (files of onnx_sdk)'
_RTMO = 'mmpose, projects/rtmo/README.md, rows body7'
_DETRPOSE = 'SebastianJanampa/DETRPose, README.md, COCO val2017'
_YOLO = 'docs.ultralytics.com, COCO-Pose, mAP 50-95, size 640'


class Published(NamedTuple):
    """What a maker publishes of a network: AP of COCO's keypoints (val2017 unless the source says other), and where."""

    label: str
    ap: float
    source: str


def _ap(name: str) -> float:
    """Return what the registry says of a network that is fetched by name."""
    return cast(WebArchive, MODELS[name].source).published_ap


# By the name of the file that `make_random.py` writes, or of a default network. Those without an entry have no such AP:
# MoveNet MultiPose, networks for 26 and 133 points (other sets), YOLOX (boxes). Not all of them are measured.
PUBLISHED: Dict[str, Published] = {
    'mobilenet_thin': Published('mobilenet_thin (default)', MOBILENET_AP, 'tf-pose-estimation, README, COCO val2014'),
    'rtmpose_t': Published('RTMPose-t', 0.659, _RTMPOSE),
    'rtmpose_s': Published('RTMPose-s', _ap('rtmpose_s'), _RTMPOSE),
    'rtmpose_m': Published('RTMPose-m', _ap('rtmpose_m'), _RTMPOSE),
    'rtmpose_l': Published('RTMPose-l', 0.767, _RTMPOSE),
    'rtmpose_m_384': Published('RTMPose-m 384', 0.766, _RTMPOSE),
    'rtmpose_l_384': Published('RTMPose-l 384', 0.783, _RTMPOSE),
    'rtmo_s': Published('RTMO-s', _ap('rtmo_s'), _RTMO),
    'yolo11n_pose': Published('YOLO11n-pose', 0.500, _YOLO), 'yolo26n_pose': Published('YOLO26n-pose', 0.572, _YOLO),
    'detrpose_n': Published('DETRPose-N', 0.572, _DETRPOSE), 'detrpose_s': Published('DETRPose-S', 0.670, _DETRPOSE),
    'detrpose_m': Published('DETRPose-M', 0.694, _DETRPOSE),
    'rf_detr_keypoint': Published('RF-DETR Keypoint', 0.718, 'PyPI rfdetr 1.11.2, README, Keypoint (Preview)'),
    'lightweight_openpose': Published('Lightweight OpenPose', 0.400, 'Daniil-Osokin/lightweight-human-pose-estimation'
                                      '.pytorch, README'),
    'human-pose-estimation-0001': Published('human-pose-estimation-0001', 0.428, 'Open Model Zoo, its README'),
    'rtmo_m': Published('RTMO-m', 0.726, _RTMO), 'rtmo_l': Published('RTMO-l', 0.748, _RTMO),
    'movenet_thunder': Published('MoveNet Thunder (default)', 0.720, 'tensorflow.org, Pose estimation: images of COCO '
                                 'cut to one person, another set than those of the others')}
# Networks that see one person, on a crop.
CROPS = ('rtmpose_', 'movenet_thunder')
# Drawn hollow: their AP is of another set.
OTHER_SET = ('mobilenet_thin', 'movenet_thunder')
# Labels that would lie on others: offset from their point [pt].
_BESIDE, _OFFSETS = (7, -3), {'rtmpose_m_384': (14, -13), 'rtmpose_l': (-12, 7), 'yolo26n_pose': (-30, 7)}
# Where a network without a published AP is marked.
_NO_AP = 0.22


def draw_plot(shares: Mapping[str, Mapping[str, float]]) -> None:
    """Write the plot of published AP against measured shares of T in f32, and in reduced precision as a line to it."""
    drawing = new_figure(7.5, 4.6)
    axes = drawing.subplots()
    for name, published in PUBLISHED.items():
        if name not in shares:
            continue
        is_crop, share = name.startswith(CROPS), shares[name]
        colour = PALETTE[1] if is_crop else PALETTE[0]
        if 'auto' in share:
            axes.plot([share['auto'], share['f32']], 2 * [published.ap], color=colour, lw=1, alpha=0.5)
        axes.plot([share['f32']], [published.ap], 's' if is_crop else 'o', color=colour, ms=6,
                  mfc='white' if name in OTHER_SET else colour)
        axes.annotate(published.label, (share['f32'], published.ap), _OFFSETS.get(name, _BESIDE),
                      textcoords='offset points', fontsize='small')
    multipose = shares.get('movenet_multipose', {})
    if multipose:
        axes.plot([multipose.get('auto', multipose['f32']), multipose['f32']], 2 * [_NO_AP], color=PALETTE[0], lw=1)
        axes.annotate('MoveNet MultiPose (default): no such AP published', (multipose['f32'], _NO_AP), _BESIDE,
                      textcoords='offset points', fontsize='small')
    for marker, colour, label in (('o', PALETTE[0], 'whole image'), ('s', PALETTE[1], 'crop of one person, its boxes '
                                  'from another network')):
        axes.plot([], [], marker, color=colour, label=label)
    axes.plot([], [], '-', color=HELP_COLOUR, label='to the left: auto (bf16)')
    axes.set_xscale('log')
    axes.xaxis.set_major_locator(FixedLocator([0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10]))
    axes.xaxis.set_major_formatter(FormatStrFormatter('%g'))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.margins(x=0.2)
    tidy_axes(axes, 'time of a pass, measured with random weights [T]', 'AP on COCO, as published')
    axes.legend(frameon=False, fontsize='small', loc=(0.5, 0.22))
    PLOT.parent.mkdir(exist_ok=True)
    save_figure(drawing, PLOT)


def write_table(t: float, threads: int, rounds: int, table: str) -> None:
    """Write the table of shares with what it was made by, and the sources of the published accuracy."""
    by = made(t)
    sources = '\n'.join(f'- {each.label}: AP {each.ap:.3f}; {each.source}' for each in PUBLISHED.values())
    TABLE.write_text(
        f'''# Time of pose networks

Written by `./run bench networks shares FOLDER --write`. Architectures of the makers' public configurations with random
weights (`development/benchmarks/networks/make_random.py`), and the default networks. Time of a pass as a share of T,
one f32 pass of mobilenet_thin at 656 x 368; medians of {rounds} rounds in which all take turns; {threads} threads of
{by['processor']}; T = {by['T_ms']} ms; commit {by['commit']}, {by['date']}.

{table}
Networks for one person: a pass is one crop; of 4 crops side by side, the time of one.

## Accuracy as published

{sources}
''')
