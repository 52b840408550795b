# SPDX-License-Identifier: BSD-3-Clause
"""Python package of sewing_cell, for catkin_python_setup (not to be run by hand)."""
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=['sewing_cell'], package_dir={'': 'src'}))
