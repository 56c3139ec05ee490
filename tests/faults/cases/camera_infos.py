"""Camera infos that describe no camera."""
from faults.fault import Fault
from faults.injectors import NAN, changed, with_matrix

CASES = [
    ('K of zeros', with_matrix(**{f'k{i}': 0.0 for i in range(9)}), 'camera is not calibrated'),
    ('K with NaN', with_matrix(k0=NAN), 'expected 9 finite numbers'),
    ('K with shear', with_matrix(k1=1.0), 'expected [fx 0 cx; 0 fy cy; 0 0 1]'),
    ('D of NaN', changed('info', D=[NAN] * 5), "D of distortion model 'plumb_bob'"),
    ('D of 100 000 values', changed('info', D=[0.1] * 100_000), "D of distortion model 'plumb_bob'"),
    ('unknown distortion model', changed('info', distortion_model='none_such', D=[0.1]),
     "distortion model 'none_such' is unknown"),
    ('width 0', changed('info', width=0), 'camera has size 0 x 540'),
    ('another aspect than the images', changed('info', width=640, height=480), 'aspect ratios differ'),
]
FAULTS = [
    *(Fault(title, inject, 'depth/people', words=(words,)) for title, inject, words in CASES),
    Fault('no D', changed('info', D=[]), 'depth/people', event=''),
    Fault('P of zeros, where K is read', changed('info', P=[0.0] * 12), 'depth/people', event=''),
]
