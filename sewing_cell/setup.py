# SPDX-License-Identifier: BSD-3-Clause
"""Python packages of sewing_cell, for catkin_python_setup (not to be run by hand)."""
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import find_packages, setup

setup(**generate_distutils_setup(package_dir={'': 'src'}, packages=find_packages(where='src')))
