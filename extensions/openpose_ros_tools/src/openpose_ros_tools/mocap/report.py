"""The report of a comparison with motion capture: tables as text and as a page of HTML, all figures as JSON."""
import html
import json
from pathlib import Path
from typing import Dict, Optional

import numpy as np
import pandas as pd

from openpose_ros_tools.alignment.alignment import Alignment
from openpose_ros_tools.mocap.evaluation import Comparison
from openpose_ros_tools.mocap.figures import PCK_DISTANCES, Figures, number_or_none, summarize
from openpose_ros_tools.mocap.study import study
from openpose_ros_tools.outputs import PartFiles
from openpose_ros_tools.tables.keypoint_table import STATUS_WORDS
from skeleton_extract_3d.points.transform import quaternions

_PAGE = Path(__file__).resolve().parents[1] / 'data' / 'mocap_report.html'
FILES = ('report.html', 'summary.json', 'errors.csv')
"""Files of a report."""
# Version of the layout of summary.json, for programs that read it.
_LAYOUT = 2
# Titles of the tables.
_ERRORS, _STUDY, _PEOPLE, _LIMBS = (
    'Errors [mm] (mean: MPJPE), and shares [%] of the joints of the reference; PCK: within 50, 100, 150 mm',
    "As validation studies report: RMSE of trajectories [mm] and angles [deg], Pearson's r, motion of the reference",
    'People: frames, errors [mm]', 'Lengths of limbs [mm]; variation: of the lengths of a person [%]')
# How columns are written that are not lengths or percentages.
_FORMS = {'r': '{:.2f}'.format, 'samples': '{:.0f}'.format}


def summary(comparison: Comparison, alignment: Alignment, inputs: Dict[str, str]) -> Figures:
    """Return all figures of a comparison, ready for JSON; inputs: names of the files, as they appear in the report."""
    quaternion, = quaternions(alignment.rotation[None])
    clock_std, rotation_std, translation_std = alignment.std
    matrix = np.vstack([np.column_stack([alignment.rotation, alignment.translation]), [0, 0, 0, 1]])
    return {
        'layout': _LAYOUT, 'inputs': inputs, 'warnings': list(alignment.warnings),
        'clock': {
            'offset_s': alignment.clock_offset, 'meaning': 'time of the reference minus time of the estimate',
            'given': alignment.clock_given, 'std_ms': number_or_none(1e3 * clock_std),
            'peak_correlation': None if alignment.speed_correlation is None else number_or_none(
                alignment.speed_correlation)},
        'transform': {
            'meaning': 'x_reference = R x_estimate + t', 'given': alignment.transform_given,
            'translation_m': np.round(alignment.translation, 9).tolist(),
            'quaternion_xyzw': np.round(quaternion, 9).tolist(), 'matrix': np.round(matrix, 9).tolist(),
            'rotation_std_deg': number_or_none(rotation_std),
            'translation_std_mm': number_or_none(1e3 * translation_std)},
        'alignment': {
            'median_residual_mm': number_or_none(1e3 * alignment.residual), 'scale': number_or_none(alignment.scale),
            'joint_samples': alignment.samples, 'best_other_solution': number_or_none(alignment.rival)},
        **summarize(comparison), 'study': study(comparison, alignment.rotation)}


def facts(values: Figures) -> Dict[str, str]:
    """Return what was aligned and compared, by name."""
    clock, place, fit, compared = (values[name] for name in ('clock', 'transform', 'alignment', 'compared'))
    quaternion, translation = (' '.join(f'{value:.{digits}f}' for value in place[name]) for name, digits in (
        ('quaternion_xyzw', 5), ('translation_m', 4)))
    found = {
        'clock offset': f"{clock['offset_s']:.4f} s ({clock['meaning']}), " + (
            'given' if clock['given'] else
            f"found, ± {_text(clock['std_ms'])} ms, correlation {_text(clock['peak_correlation'], '.2f')}"),
        'camera in the reference': f'x y z {translation} m, qx qy qz qw {quaternion}, ' + (
            'given' if place['given'] else f"found, ± {_text(place['translation_std_mm'])} mm at the people, "
            f"± {_text(place['rotation_std_deg'], '.2f')}°") + f" ({place['meaning']})",
        'fit': f"median distance {_text(fit['median_residual_mm'])} mm over {fit['joint_samples']} measured joints, "
               f"scale {_text(fit['scale'], '.4f')} (not applied)",
        'people': f"{compared['people_found']} of {compared['people_found'] + compared['people_missed']} in "
                  f"{compared['frames']} frames found, {compared['people_without_reference']} without a reference, "
                  f"{compared['id_switches']} changes of id",
        'left out': f"{compared['frames_outside_reference']} frames before or after the reference, about "
                    f"{compared['frames_without_people_or_dropped']} without people or dropped"}
    for side in ('reference', 'estimate'):
        names = ', '.join(compared[f'joints_only_in_{side}']).replace('_', ' ')
        found.update({f'joints only in the {side}': names} if names else {})
    for kind, one in values['sigma'].items():
        found[f'sigma, {kind}'] = (
            f"{_text(100 * one['within_1_sigma'])} % within 1 sigma, {_text(100 * one['within_2_sigma'])} % within 2; "
            f"root mean square {_text(one['rms_sigma_mm'])} mm claimed, {_text(one['rms_error_mm'])} mm true")
    return found


def _flat(values: Figures) -> Figures:
    """Return figures of which some hold others, such as 'measured', in one level: 'measured.mean_mm'."""
    return {f'{name}.{key}'.strip('.'): value for name, one in values.items()
            for key, value in (one.items() if isinstance(one, dict) else [('', one)])}


def tables(values: Figures) -> Dict[str, pd.DataFrame]:
    """Return the errors, the figures of validation studies, people and limbs as tables, by title."""
    joints = pd.DataFrame([_flat(one) for one in (*values['joints'].values(), values['overall'])])
    joints.index = [*(name.replace('_', ' ') for name in values['joints']), 'all joints']
    shares = {'share_answered': 'answered', **{key: key.replace('pck_', 'PCK ') for key in PCK_DISTANCES},
              **{f'{kind}.share_of_reference': kind for kind in ('measured', 'inferred')}}
    joints[list(shares)] *= 100
    kinds = (('', ''), ('measured.', 'm. '), ('inferred.', 'i. '))
    errors = {f'{kind}{name}_mm': f'{label}{name}' for kind, label in kinds
              for name in ('mean', 'median', 'p90') if name != 'p90' or not kind}
    found = {_ERRORS: joints[[*errors, *shares]].rename(columns={**errors, **shares}).astype(float)}
    rows = [{'': part, 'axis': axis, **one,
             'measured alone': values['study']['measured'].get(part, {}).get(axis, {}).get('rmse')}
            for part, axes in values['study']['answered'].items() for axis, one in axes.items()]
    if rows:
        found[_STUDY] = pd.DataFrame(rows).set_index(['', 'axis']).rename(
            columns=lambda name: name.replace('_', ' ')).astype(float)
    people = pd.DataFrame(values['subjects']).T
    found[_PEOPLE] = people[['frames_found', 'frames_missed', 'mean_mm', 'median_mm', 'p90_mm']]
    if values['bones']:
        found[_LIMBS] = pd.DataFrame(values['bones']).T.astype(float)
        found[_LIMBS][['variation', 'reference_variation']] *= 100
    return found


def text(values: Figures) -> str:
    """Return facts, errors and the figures of studies in plain text, for a terminal."""
    known, shown = facts(values), tables(values)
    width = max(map(len, known))
    lines = [f'{name.ljust(width)}  {fact}' for name, fact in known.items()]
    for title in filter(shown.__contains__, (_ERRORS, _STUDY)):
        lines += ['', title, shown[title].to_string(na_rep='-', float_format='{:.1f}'.format, formatters=_FORMS)]
    return '\n'.join([*lines, ''])


def write_report(folder: Path, comparison: Comparison, values: Figures) -> None:
    """Write `FILES` into a folder; an interrupt leaves an older report. OSError: it can not be written to."""
    errors = comparison.table().dropna(subset=['error']).drop(columns='found')
    errors = errors.assign(time=errors.time.map('{:.6f}'.format), status=errors.status.map(STATUS_WORDS))
    body = [f'<p>{html.escape(name)}: {html.escape(value)}</p>' for name, value in values['inputs'].items()]
    body += [f'<p class="warning">Warning: {html.escape(warning)}.</p>' for warning in values['warnings']]
    body += [f'<p>{html.escape(name)}: {html.escape(fact)}</p>' for name, fact in facts(values).items()]
    for title, table in tables(values).items():
        body += [f'<h2>{html.escape(title)}</h2>', table.to_html(
            na_rep='-', float_format='{:.1f}'.format, formatters=_FORMS, border=0)]
    with PartFiles() as parts:
        part = parts.folder(folder.resolve(), FILES.__contains__)
        page = _PAGE.read_text(encoding='utf-8').replace('BODY', '\n'.join(body))
        (part / 'report.html').write_text(page, encoding='utf-8')
        errors.to_csv(part / 'errors.csv', index=False, float_format='%.5f')
        (part / 'summary.json').write_text(json.dumps(values, indent=1, ensure_ascii=False) + '\n', encoding='utf-8')


def _text(value: Optional[float], form: str = '.1f') -> str:
    return '-' if value is None else format(value, form)
