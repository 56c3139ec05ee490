"""The report of a comparison with motion capture: tables, plots, and all figures as JSON and CSV."""
import base64
import json
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import cv2
import jinja2
import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from openpose_ros_pkg.output.files import writable_folder
from openpose_ros_tools.alignment.alignment import Alignment
from openpose_ros_tools.mocap.evaluation import Comparison
from openpose_ros_tools.mocap.figures import PCK_KEYS, Figures, number_or_none, summarize
from openpose_ros_tools.mocap.plots import TRAJECTORIES, all_figures
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.plots.plotting import STATUS_NAMES, joint_title, save_figure

_TEMPLATES = Path(__file__).resolve().parents[1] / 'data'
_HTML, _MARKDOWN, _FACTS, _TABLE = 'mocap_report.html', 'mocap_report.md', 'mocap_facts.txt', 'mocap_table.txt'
# Files of a report beside the trajectories.
_FILES = ('report.html', 'report.md', 'summary.json', 'joints.csv', 'bones.csv', 'errors.csv', 'error_per_joint.png',
          'error_over_time.png', 'stick_figures.png', 'clock_correlation.png')
# Version of the layout of summary.json, for those who read it.
_LAYOUT = 1
# Which way offset and transform go.
_CLOCK_MEANING = 'time of the reference minus time of the estimate'
_TRANSFORM_MEANING = 'x_reference = R x_estimate + t'


def summary(comparison: Comparison, alignment: Alignment, inputs: Dict[str, str]) -> Figures:
    """Return everything that is told of a comparison, ready for JSON.

    Args:
        inputs: names of the files and the options, as they shall appear in the report.
    """
    # by way of the rotation vector, since SciPy renamed from_dcm to from_matrix
    quaternion = Rotation.from_rotvec(cv2.Rodrigues(alignment.rotation)[0].ravel()).as_quat()
    matrix = np.vstack([np.column_stack([alignment.rotation, alignment.translation]), [0, 0, 0, 1]])
    return {
        'layout': _LAYOUT, 'inputs': inputs, 'warnings': list(alignment.warnings),
        'clock': {
            'offset_s': alignment.clock_offset, 'meaning': _CLOCK_MEANING, 'given': alignment.clock_given,
            'std_ms': number_or_none(1e3 * alignment.clock_std),
            'peak_correlation': None if alignment.curve is None else number_or_none(alignment.curve.peak)},
        'transform': {
            'meaning': _TRANSFORM_MEANING, 'given': alignment.transform_given,
            'translation_m': np.round(alignment.translation, 9).tolist(),
            'quaternion_xyzw': np.round(quaternion, 9).tolist(), 'matrix': np.round(matrix, 9).tolist(),
            'rotation_std_deg': number_or_none(alignment.rotation_std),
            'translation_std_mm': number_or_none(1e3 * alignment.translation_std)},
        'alignment': {
            'median_residual_mm': number_or_none(1e3 * alignment.residual), 'scale': number_or_none(alignment.scale),
            'joint_samples': alignment.samples, 'best_other_solution': number_or_none(alignment.rival)},
        **summarize(comparison)}


def table(values: Figures) -> str:
    """Return the errors as a table in plain text, for a terminal."""
    return _template(_TABLE).render(values=values, pck=PCK_KEYS).rstrip()


def facts(values: Figures) -> List[Tuple[str, str]]:
    """Return what was aligned and compared, as pairs of name and text."""
    lines = [line.partition('\t') for line in _template(_FACTS).render(values=values).splitlines() if line]
    return [(name, text) for name, _, text in lines]


def write_report(folder: Path, comparison: Comparison, alignment: Alignment, values: Figures) -> List[Path]:
    """Write report.html, report.md, summary.json, joints.csv, bones.csv, errors.csv and the plots into a folder.

    All is made in a hidden folder beside and moved at the end, in place of an older report, so that an interrupt leaves
    that as it was.

    Returns:
        The files, in the order of names.

    Raises:
        ParameterError: the folder can not be written to.
    """
    folder = writable_folder('output', folder).resolve()
    with PartFiles() as parts:
        part = parts.folder(folder, is_of_report)
        plots = []
        for name, (caption, figure) in all_figures(comparison, alignment).items():
            path = save_figure(figure, part / f'{name}.png')
            plots.append({'file': path.name, 'caption': caption,
                          'data': base64.b64encode(path.read_bytes()).decode()})
        for name in (_HTML, _MARKDOWN):
            (part / name.replace('mocap_', '')).write_text(render(name, values, plots), encoding='utf-8')
        for name, rows in (('joints', _joint_table(values)), ('bones', _bone_table(values)),
                           ('errors', _error_table(comparison))):
            rows.to_csv(part / f'{name}.csv', index=False, float_format='%.5f' if name == 'errors' else None)
        (part / 'summary.json').write_text(json.dumps(values, indent=1, ensure_ascii=False) + '\n', encoding='utf-8')
        names = sorted(path.name for path in part.iterdir())
    return [folder / name for name in names]


def is_of_report(name: str) -> bool:
    """Return whether a file's name is that of a part of a report."""
    return name in _FILES or (name.startswith(TRAJECTORIES) and name.endswith('.png'))


def render(template: str, values: Figures, plots: Sequence[Dict[str, str]]) -> str:
    """Return a report as text.

    Args:
        template: in the data folder of this package.
        plots: file, caption and base64 data of each.
    """
    return _template(template).render(values=values, facts=facts(values), plots=plots, pck=PCK_KEYS)


def _template(name: str) -> jinja2.Template:
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(str(_TEMPLATES)), undefined=jinja2.StrictUndefined,
                                     autoescape=name.endswith('.html'), trim_blocks=True, lstrip_blocks=True,
                                     keep_trailing_newline=True)
    environment.filters.update(percent=_percent, number=_text, joint=joint_title, mm=_text,
                               mm1=lambda value: _text(value, '.1f'))
    return environment.get_template(name)


def _joint_table(values: Figures) -> pd.DataFrame:
    """Return a row per joint, then one for all."""
    rows = []
    for name, figures in [*values['joints'].items(), ('all', values['overall'])]:
        rows.append({'joint': name, **{key: value for key, value in figures.items() if not isinstance(value, dict)}})
        for kind in ('measured', 'inferred'):
            rows[-1].update({f'{kind}_{key}': value for key, value in figures[kind].items()})
    return pd.DataFrame(rows)


def _bone_table(values: Figures) -> pd.DataFrame:
    return pd.DataFrame([{'bone': name, **bone} for name, bone in values['bones'].items()], columns=(
        'bone', 'samples', 'reference_mm', 'bias_mm', 'mean_abs_mm', 'variation', 'reference_variation'))


def _error_table(comparison: Comparison) -> pd.DataFrame:
    """Return a row per joint, person and frame that both have; metres, in the frame of the reference."""
    table = comparison.table().dropna(subset=['error']).drop(columns='found')
    return table.assign(time=table.time.map('{:.6f}'.format), status=table.status.map(STATUS_NAMES))


def _percent(share: Optional[float]) -> str:
    return '-' if share is None else f'{100 * share:.1f} %'


def _text(value: Optional[float], form: str = '.0f') -> str:
    return '-' if value is None else format(value, form)
