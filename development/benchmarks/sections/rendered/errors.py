"""Errors by joint, by distance, by sensor."""
from openpose_ros_pkg.skeletons import COCO_18
from results import Options, Section, Table
from results.counting import count
from results.plots import by_group
from scoring.counts import by_bin, by_tag, by_value
from scoring.figures import figures_of, named, rows_of
from scoring.people import JOINT_STATISTICS

# Columns of the tables. Distances of joints from the camera, along its axis [m].
COLUMNS = {'visible_median': 'median [mm]', 'visible_90': '90 % [mm]', 'visible_100': 'visible within 100 mm',
           'hidden_150': 'hidden within 150 mm', 'lies': 'lies', 'within_2_sigma': 'within 2 sigma'}
DISTANCES = (0, 1, 2, 3, 4, 5, 6, 8)
# Joints of both sides together.
JOINTS = {name: [row for row, joint in enumerate(COCO_18.joints) if joint.split('_')[-1] == name]
          for name in ('nose', 'eye', 'ear', 'neck', 'shoulder', 'elbow', 'wrist', 'hip', 'knee', 'ankle')}


def measure(options: Options) -> Section:
    """Count the errors of mode balanced by groups of joints."""
    counts = count(options, {'mode': 'balanced'})
    groups = {
        'joint': by_value(counts, 'joints', 'joint', JOINTS),
        'distance': {f'{name} m': each for name, each in by_bin(counts, 'joints', 'distance', DISTANCES).items()},
        'sensor': by_tag(counts, 'sensor'), 'light': by_tag(counts, 'light')}
    statistics = {key: JOINT_STATISTICS[key] for key in COLUMNS}
    found = {title: figures_of(group, statistics) for title, group in groups.items() if len(group) > 1}
    pictures = [by_group(f'errors_by_{title}', f'Errors by {title}', {
                             'median of visible joints [mm]': {'': (each, 'visible_median')},
                             'share': {'visible within 100 mm': (each, 'visible_100'),
                                       'hidden within 150 mm': (each, 'hidden_150')}})
                for title, each in found.items() if title != 'light']
    figures = named({key_of(name): one for each in found.values() for name, one in each.items()})
    shown = {name: title for name, title in COLUMNS.items() if name != 'visible_90'}
    return Section('Mode balanced, on the scenes of the section on accuracy. Distance is that of the joint along the '
                   'axis of the camera.', figures,
                   [Table('By joint', rows_of(found['joint'], shown, 'joint'))], pictures)


def key_of(group: str) -> str:
    """Return the name of a group in that of a figure: '2-3 m' is from_2_to_3_m."""
    return ('from_' + group.replace('-', '_to_').replace(' ', '_')) if group[0].isdigit() else group.lower()
