"""Hand-written files of motion capture systems, and C3D files by the library itself."""
import warnings

import numpy as np
import pytest

# As Motive 2 exports it (1.23): a marker that is hidden once, one of another person, an unlabelled one; a bone with a
# marker's name, places of markers that Motive computed, a rigid body with its error.
MOTIVE = '''\
Format Version,1.23,Take Name,"walk, slow",Capture Frame Rate,100.000000,Export Frame Rate,50.000000,\
Capture Start Time,2020-05-01 10.11.12.345 AM,Rotation Type,Quaternion,Length Units,Millimeters,Coordinate Space,Global

,Type,Bone,Bone,Bone,Bone,Bone,Bone,Bone,Bone Marker,Bone Marker,Bone Marker,Bone Marker,Bone Marker,Bone Marker,\
Marker,Marker,Marker,Marker,Marker,Marker,Marker,Marker,Marker,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,\
Rigid Body,Rigid Body,Rigid Body
,Name,Ann:Chest,Ann:Chest,Ann:Chest,Ann:Chest,Ann:Chest,Ann:Chest,Ann:Chest,Ann:Chest,Ann:Chest,Ann:Chest,\
"Ann:HeadTop","Ann:HeadTop","Ann:HeadTop",Ann:Chest,Ann:Chest,Ann:Chest,Ben:Chest,Ben:Chest,Ben:Chest,\
Unlabeled 1234,Unlabeled 1234,Unlabeled 1234,Wand,Wand,Wand,Wand,Wand,Wand,Wand,Wand
,ID,1,1,1,1,1,1,1,2,2,2,3,3,3,4,4,4,5,5,5,6,6,6,7,7,7,7,7,7,7,7
,,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Position,Position,Position,Position,Position,Position,\
Position,Position,Position,Position,Position,Position,Position,Position,Position,Rotation,Rotation,Rotation,Rotation,\
Position,Position,Position,Mean Marker Error
Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z,X,Y,Z,X,Y,Z,X,Y,Z,X,Y,Z,X,Y,Z,W,X,Y,Z,
10,0.200000,0,0,0,1,11,12,13,1,1,1,21,22,23,31,32,33,41,42,43,,,,0,0,0,1,51,52,53,0.1
11,0.220000,0,0,0,1,11,12,13,1,1,1,21,22,23,,,,41,42,43,61,62,63,0,0,0,1,51,52,53,0.1
'''
# Rows without labels, a column with time codes, metres.
MOTIVE_SHORT = '''\
Format Version,1.24,Take Name,t,Length Units,Meters

,,,Marker,Marker,Marker
,,,Head,Head,Head
,,,AB,AB,AB
,,,Position,Position,Position
Frame,Time (Seconds),TimeCode,X,Y,Z
0,0.000000,15:26:46:12.02,1.5,-2.5,1e-3
1,0.010000,15:26:46:12.03,,,
'''
TRC = ('PathFileType\t4\t(X/Y/Z)\twalk.trc\n'
       'DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames\n'
       '60.00\t60.00\t3\t2\tmm\t60.00\t1\t3\n'
       'Frame#\tTime\tLSHO\t\t\tRSHO\t\t\t\n'
       '\t\tX1\tY1\tZ1\tX2\tY2\tZ2\t\n'
       '\n'
       '1\t0.000\t10.0\t20.0\t30.0\t1000\t2000\t3000\t\n'
       '2\t0.017\t\t\t\t1001\t2001\t3001\t\n'
       '3\t0.033\t12.0\t22.0\t32.0\t\t\t\n')


def c3d_file(path, unit='mm', points=None, labels=('A   ', 'B   '), first=1, rate=100.0, scale=-1.0):
    """Write by the library itself: frames of two points."""
    library = pytest.importorskip('c3d')
    writer = library.Writer(point_rate=rate, point_units=unit, point_scale=scale)
    if labels:
        writer.set_point_labels(list(labels))
    writer.set_start_frame(first)
    points = np.full((3, 2, 5), 500.0) if points is None else points
    points[..., 3:] = 0
    points[1, 1, 3] = -1
    points[2, 0, :3] = 0
    writer.add_frames([(frame, np.zeros((0, 0))) for frame in points])
    with path.open('wb') as handle, warnings.catch_warnings():
        warnings.simplefilter('ignore')  # no analog data, no labels
        writer.write(handle)
    return path
