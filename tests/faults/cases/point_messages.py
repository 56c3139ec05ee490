"""Clouds and depth images that contradict themselves."""
from faults.fault import Fault
from faults.injectors import changed

FAULTS = [
    Fault('cloud of a row', changed('points', height=1), words=('cloud is not organized',)),
    Fault('depth image of three channels', changed('points', encoding='rgb8'), node='depth/people',
          words=("depth image has encoding 'rgb8'",)),
    Fault('cloud of a row, to the extractor alone', changed('points', height=1), node='two/extractor',
          words=('cloud is not organized',)),
]
