"""Find people's body joints in images: a ROS-free core, and thin ROS nodes around it in ``ros/``.

Importing it appends the folder of the packages from PyPI (OpenVINO), which setup.bash names, to Python's path.
"""
import os
import sys

# Pixels of an image beyond which OpenCV decodes no file of any format.
HARDEST_LIMIT = 200_000_000
# OpenCV reads this when it is loaded (loadsave.cpp of its imgcodecs), so before anything here can import it.
os.environ.setdefault('OPENCV_IO_MAX_IMAGE_PIXELS', str(HARDEST_LIMIT))

_site_packages = os.environ.get('OPENPOSE_ROS_SITE_PACKAGES')
if _site_packages and _site_packages not in sys.path:
    sys.path.append(_site_packages)
