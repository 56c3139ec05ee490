"""Why constants that move nothing are kept; by path or its start."""
from typing import Dict

KEPT: Dict[str, str] = {
    'body': 'anthropometry, used as a table',
    'windows.limits': 'guard: time and memory of people near the camera',
    'trunk.furthest': 'guard: length of the table of depths',
    'trunk.front': 'with `behind` the model of surfaces before and behind a body',
    'trunk.behind': 'see `front`',
    'trunk.foreshortening': 'children (unit test)',
    'costs.under': 'lies rise by 0.1 points without it',
    'costs.anything': 'probabilities are never 0',
    'occluders.others_reach': 'two ids are exchanged without it (12 scenes)',
    'sizes': 'as `known`',
    'track.birth.speed': 'a filter needs a first covariance',
    'track.identity': 'ids are exchanged in an embrace when either cost is left out (12 scenes)',
    'track.appearance': 'people come back: none does in these scenes (unit tests)',
    'track.returning': 'people come back: none does in these scenes (unit tests)',
    'track.correction.root_measured': 'of the trunk as a whole, which follows hidden people',
    'track.correction.measured_reach': 'lies rise by 0.2 points without it (5 scenes)',
    'track.correction.down_share': 'visible joints -0.06 points at 1 (14 scenes)',
    'track.out_of_sight': 'false detections would be reported on (unit tests)',
    'track.one_body': 'networks that find a person twice or in parts (unit tests)'}


def reason_of(path: str) -> str:
    """Return the text of a path, or of the longest beginning of it that has one; empty: there is none."""
    names = path.split('.')
    return next((KEPT['.'.join(names[:count])] for count in range(len(names), 0, -1)
                 if '.'.join(names[:count]) in KEPT), '')
