"""The report of a comparison with motion capture: tables, pictures, and all figures as JSON and CSV."""
import base64
import json
from pathlib import Path
from typing import Any, Dict, List, Optional, Sequence, Tuple

import cv2
import jinja2
import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

from openpose_ros_mocap.alignment import Alignment
from openpose_ros_mocap.evaluation import Comparison
from openpose_ros_mocap.figures import PCK_KEYS, Figures, number_or_none, summarize
from openpose_ros_mocap.plots import TRAJECTORIES, all_figures
from openpose_ros_pkg.output.files import writable_folder
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.plots.plotting import STATUS_NAMES, joint_title, save_figure

_TEMPLATES = Path(__file__).resolve().parent / 'data'
_HTML, _MARKDOWN = 'mocap_report.html', 'mocap_report.md'
# Version of the layout of summary.json, for those who read it.
_LAYOUT = 1
# Which way offset and transform go.
_CLOCK_MEANING = 'time of the reference minus time of the estimate'
_TRANSFORM_MEANING = 'x_reference = R x_estimate + t'


def summary(comparison: Comparison, alignment: Alignment, inputs: Dict[str, Any]) -> Figures:
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
            'translation_m': _list(alignment.translation),
            'quaternion_xyzw': _list(quaternion), 'matrix': [_list(row) for row in matrix],
            'rotation_std_deg': number_or_none(alignment.rotation_std),
            'translation_std_mm': number_or_none(1e3 * alignment.translation_std)},
        'alignment': {
            'median_residual_mm': number_or_none(1e3 * alignment.residual), 'scale': number_or_none(alignment.scale),
            'joint_samples': alignment.samples, 'best_other_solution': number_or_none(alignment.rival)},
        **summarize(comparison)}


def table(values: Figures) -> str:
    """Return the errors as a table in plain text, for a terminal."""
    header = ('joint', 'answered', 'mean', 'median', 'p90', *(f'PCK {name[4:]}' for name in PCK_KEYS),
              'measured', 'median', 'inferred', 'median')
    lines = [header, *(_row(joint_title(joint), figures) for joint, figures in values['joints'].items()),
             _row('all joints', values['overall'])]
    widths = [max(len(line[column]) for line in lines) for column in range(len(header))]
    text = ['  '.join(cell.ljust(width) if column == 0 else cell.rjust(width)
                      for column, (cell, width) in enumerate(zip(line, widths))) for line in lines]
    note = 'errors in mm (their mean is the MPJPE); PCK: share of the joints of the reference within 50, 100, 150 mm'
    rule = '-' * len(text[0])
    return '\n'.join([note, text[0], rule, *text[1:-1], rule, text[-1]])


def facts(values: Figures) -> List[Tuple[str, str]]:
    """Return what was aligned and compared, as pairs of name and text."""
    clock, transform, fit, compared = (values[key] for key in ('clock', 'transform', 'alignment', 'compared'))
    offset = f"{clock['offset_s']:.4f} s ({_CLOCK_MEANING}), " + (
        'given' if clock['given'] else f"found, ± {_text(clock['std_ms'], '.1f')} ms, correlation "
        f"{_text(clock['peak_correlation'], '.2f')}")
    place = (f"x y z {_numbers(transform['translation_m'], 4)} m, qx qy qz qw "
             f"{_numbers(transform['quaternion_xyzw'], 5)}, ") + (
        'given' if transform['given'] else f"found, ± {_text(transform['translation_std_mm'], '.1f')} mm at the "
        f"people, ± {_text(transform['rotation_std_deg'], '.2f')}°") + f' ({_TRANSFORM_MEANING})'
    people = (f"{compared['people_found']} of {compared['people_found'] + compared['people_missed']} in "
              f"{compared['frames']} frames found ({_percent(compared['share_found'])}), "
              f"{compared['people_without_reference']} without a reference, {compared['id_switches']} changes of id")
    lines = [('clock offset', offset), ('camera in the reference', place),
             ('fit', f"median distance {_text(fit['median_residual_mm'], '.1f')} mm over {fit['joint_samples']} "
                     f"measured joints, scale {_text(fit['scale'], '.4f')} (not applied)"),
             ('people', people)]
    if compared['frames_outside_reference']:
        lines.append(('left out', f"{compared['frames_outside_reference']} frame(s) before or after the reference"))
    if compared['frames_without_people_or_dropped']:
        lines.append(('not counted', f"about {compared['frames_without_people_or_dropped']} frames without people, or "
                                     'dropped: the poses do not tell which'))
    for key, name in (('joints_only_in_reference', 'joints only in the reference'),
                      ('joints_only_in_estimate', 'joints only in the estimate')):
        if compared[key]:
            lines.append((name, ', '.join(joint_title(joint) for joint in compared[key])))
    for kind, figures in values['sigma'].items():
        shares = ', '.join(f"{_percent(figures[f'within_{times}_sigma'])} within {times} sigma" for times in (1, 2))
        lines.append((f'sigma, {kind}', f"{shares}; root mean square {figures['rms_sigma_mm']:.0f} mm claimed, "
                                        f"{figures['rms_error_mm']:.0f} mm true"))
    return lines


def write_report(folder: Path, comparison: Comparison, alignment: Alignment, values: Figures) -> List[Path]:
    """Write report.html, report.md, summary.json, joints.csv, bones.csv, errors.csv and the pictures into a folder.

    All is made in a hidden folder beside and moved at the end, so that an interrupt leaves an older report as it was.
    Pictures of people whom an older one had go then.

    Returns:
        The files, in the order of names.

    Raises:
        ParameterError: the folder can not be written to.
    """
    folder = writable_folder('output', folder).resolve()
    with PartFiles() as parts:
        part = parts.folder(folder, is_old=lambda name: name.startswith(TRAJECTORIES) and name.endswith('.png'))
        pictures = []
        for name, (caption, figure) in all_figures(comparison, alignment).items():
            path = save_figure(figure, part / f'{name}.png')
            pictures.append({'file': path.name, 'caption': caption,
                             'data': base64.b64encode(path.read_bytes()).decode()})
        for name in (_HTML, _MARKDOWN):
            (part / name.replace('mocap_', '')).write_text(render(name, values, pictures), encoding='utf-8')
        for name, rows in (('joints', _joint_table(values)), ('bones', _bone_table(values)),
                           ('errors', _error_table(comparison))):
            rows.to_csv(part / f'{name}.csv', index=False, float_format='%.5f' if name == 'errors' else None)
        (part / 'summary.json').write_text(json.dumps(values, indent=1, ensure_ascii=False) + '\n', encoding='utf-8')
        names = sorted(path.name for path in part.iterdir())
    return [folder / name for name in names]


def render(template: str, values: Figures, pictures: Sequence[Dict[str, str]]) -> str:
    """Return a report as text.

    Args:
        template: in the data folder of this package.
        pictures: file, caption and base64 data of each.
    """
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(str(_TEMPLATES)), undefined=jinja2.StrictUndefined,
                                     autoescape=template.endswith('.html'), trim_blocks=True, lstrip_blocks=True,
                                     keep_trailing_newline=True)
    environment.filters.update(percent=_percent, mm=lambda value: _text(value, '.0f'),
                               mm1=lambda value: _text(value, '.1f'), joint=joint_title)
    return environment.get_template(template).render(values=values, facts=facts(values), pictures=pictures,
                                                     pck=PCK_KEYS)


def _row(name: str, figures: Figures) -> Tuple[str, ...]:
    measured, inferred = figures['measured'], figures['inferred']
    return (name, _percent(figures['share_answered']), *(_text(figures[key], '.0f') for key in
                                                         ('mean_mm', 'median_mm', 'p90_mm')),
            *(_percent(figures[key]) for key in PCK_KEYS), _percent(measured['share_of_reference']),
            _text(measured['median_mm'], '.0f'), _percent(inferred['share_of_reference']),
            _text(inferred['median_mm'], '.0f'))


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


def _text(value: Optional[float], form: str) -> str:
    return '-' if value is None else format(value, form)


def _numbers(values: Sequence[float], digits: int) -> str:
    return ' '.join(f'{value:.{digits}f}' for value in values)


def _list(values: np.ndarray) -> List[float]:
    return [round(float(value), 9) for value in values]
