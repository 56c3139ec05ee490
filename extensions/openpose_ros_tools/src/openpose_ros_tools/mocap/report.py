"""The report of a comparison with motion capture: a table in plain text, a page of HTML, figures as JSON."""
import base64
import json
from pathlib import Path
from typing import TYPE_CHECKING, Dict, List, Optional, Tuple

import numpy as np

from openpose_ros_pkg.output.files import writable_folder
from openpose_ros_tools.alignment.alignment import Alignment
from openpose_ros_tools.mocap.evaluation import Comparison
from openpose_ros_tools.mocap.figures import PCK_DISTANCES, Figures, number_or_none, summarize
from openpose_ros_tools.mocap.study import study
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.tables.keypoint_table import STATUS_WORDS
from skeleton_extract_3d.points.transform import quaternions

if TYPE_CHECKING:
    import jinja2

_TEMPLATES = Path(__file__).resolve().parents[1] / 'data'
_HTML, _FACTS, _TABLE = 'mocap_report.html', 'mocap_facts.txt', 'mocap_table.txt'
FILES = ('report.html', 'summary.json', 'errors.csv')
"""Files of a report."""
# Version of the layout of summary.json, for programs that read it.
_LAYOUT = 2


def summary(comparison: Comparison, alignment: Alignment, inputs: Dict[str, str]) -> Figures:
    """Return everything that is told of a comparison, ready for JSON.

    Args:
        inputs: names of the files and the options, as they shall appear in the report.
    """
    quaternion, = quaternions(alignment.rotation[None])
    matrix = np.vstack([np.column_stack([alignment.rotation, alignment.translation]), [0, 0, 0, 1]])
    return {
        'layout': _LAYOUT, 'inputs': inputs, 'warnings': list(alignment.warnings),
        'clock': {
            'offset_s': alignment.clock_offset, 'meaning': 'time of the reference minus time of the estimate',
            'given': alignment.clock_given, 'std_ms': number_or_none(1e3 * alignment.clock_std),
            'peak_correlation': None if alignment.speed_correlation is None else number_or_none(
                alignment.speed_correlation)},
        'transform': {
            'meaning': 'x_reference = R x_estimate + t', 'given': alignment.transform_given,
            'translation_m': np.round(alignment.translation, 9).tolist(),
            'quaternion_xyzw': np.round(quaternion, 9).tolist(), 'matrix': np.round(matrix, 9).tolist(),
            'rotation_std_deg': number_or_none(alignment.rotation_std),
            'translation_std_mm': number_or_none(1e3 * alignment.translation_std)},
        'alignment': {
            'median_residual_mm': number_or_none(1e3 * alignment.residual), 'scale': number_or_none(alignment.scale),
            'joint_samples': alignment.samples, 'best_other_solution': number_or_none(alignment.rival)},
        **summarize(comparison), 'study': study(comparison, alignment.rotation)}


def table(values: Figures) -> str:
    """Return the errors as a table in plain text, for a terminal."""
    return _template(_TABLE).render(values=values, pck=list(PCK_DISTANCES)).rstrip()


def facts(values: Figures) -> List[Tuple[str, str]]:
    """Return what was aligned and compared, as pairs of name and text."""
    lines = [line.partition('\t') for line in _template(_FACTS).render(values=values).splitlines() if line]
    return [(name, text) for name, _, text in lines]


def write_report(folder: Path, comparison: Comparison, values: Figures) -> None:
    """Write report.html, summary.json and errors.csv into a folder; an interrupt leaves an older report as it was.

    Raises:
        ParameterError: the folder can not be written to.
    """
    from openpose_ros_tools.mocap.plots import has_limbs, stick_figures
    from openpose_ros_tools.plots.plotting import figure_content
    errors = comparison.table().dropna(subset=['error']).drop(columns='found')
    errors = errors.assign(time=errors.time.map('{:.6f}'.format), status=errors.status.map(STATUS_WORDS))
    folder = writable_folder('output', folder).resolve()
    with PartFiles() as parts:
        part = parts.folder(folder, FILES.__contains__)
        picture = figure_content(stick_figures(comparison), 'png') if has_limbs(comparison) else b''
        page = _template(_HTML).render(values=values, facts=facts(values), pck=list(PCK_DISTANCES),
                                       picture=base64.b64encode(picture).decode())
        (part / 'report.html').write_text(page, encoding='utf-8')
        errors.to_csv(part / 'errors.csv', index=False, float_format='%.5f')
        (part / 'summary.json').write_text(json.dumps(values, indent=1, ensure_ascii=False) + '\n', encoding='utf-8')


def _template(name: str) -> 'jinja2.Template':
    import jinja2
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(str(_TEMPLATES)), undefined=jinja2.StrictUndefined,
                                     autoescape=name.endswith('.html'), trim_blocks=True, lstrip_blocks=True,
                                     keep_trailing_newline=True)

    def text(value: Optional[float], form: str = '.0f') -> str:
        return '-' if value is None else format(value, form)

    environment.filters.update(
        number=text, mm=text, mm1=lambda value: text(value, '.1f'), joint=lambda name: name.replace('_', ' '),
        percent=lambda share: '-' if share is None else f'{100 * share:.1f} %')
    return environment.get_template(name)
