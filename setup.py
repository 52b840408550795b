# SPDX-License-Identifier: BSD-3-Clause
"""Python packages of process_visualizer, for catkin_python_setup (not to be run by hand)."""
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import find_packages, setup

# catkin runs this file in its folder, for both the devel space and the install space.
setup(**generate_distutils_setup(
    package_dir={'': 'src'}, packages=find_packages(where='src'),
    package_data={'process_visualizer': ['gui/toolkit/icons/*.svg']}))
