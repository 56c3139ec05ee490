"""Camera infos that describe no camera."""
from typing import Any

from faults.fault import Fault
from faults.injectors import Injector, altered, changed

NAN = float('nan')


def matrix(**elements: float) -> Injector:
    """Return what sends a camera info with other elements of K, k0 to k8."""
    def change(frame: Any) -> None:
        frame.info.K = [elements.get(f'k{i}', value) for i, value in enumerate(frame.info.K)]
    return altered(change)


def lens(*distortion: float) -> Injector:
    return changed('info', D=list(distortion))


CASES = [
    ('K of zeros', matrix(**{f'k{i}': 0.0 for i in range(9)}), 'camera is not calibrated'),
    ('K with NaN', matrix(k0=NAN), 'expected 9 finite numbers'),
    ('K with shear', matrix(k1=1.0), 'expected [fx 0 cx; 0 fy cy; 0 0 1]'),
    ('D of NaN', lens(*[NAN] * 5), "D of distortion model 'plumb_bob'"),
    ('D of 100 000 values', lens(*[0.1] * 100_000), "D of distortion model 'plumb_bob'"),
    ('unknown distortion model', changed('info', distortion_model='none_such', D=[0.1]),
     "distortion model 'none_such' is unknown"),
    ('width 0', changed('info', width=0), 'camera has size 0 x 540'),
    ('another aspect than the images', changed('info', width=640, height=480), 'aspect ratios differ'),
]
FAULTS = [
    *(Fault(title, inject, 'depth/people', words=(words,)) for title, inject, words in CASES),
    Fault('no D', lens(), 'depth/people', event=''),
    Fault('P of zeros, where K is read', changed('info', P=[0.0] * 12), 'depth/people', event=''),
]
