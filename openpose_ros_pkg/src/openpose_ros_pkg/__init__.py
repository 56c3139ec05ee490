"""Find people's body joints in images: a ROS-free core, and thin ROS nodes around it in ``ros/``.

Whoever imports it sees what PyPI brings (OpenVINO) behind everything else; setup.bash says where that lies.
"""
import os
import sys

_site_packages = os.environ.get('OPENPOSE_ROS_SITE_PACKAGES')
if _site_packages and _site_packages not in sys.path:
    sys.path.append(_site_packages)
