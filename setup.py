"""Python packages of process_visualizer, for catkin_python_setup (not to be run by hand)."""
from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(
    package_dir={'': 'src'},
    packages=[
        'process_visualizer',
        'process_visualizer.bags',
        'process_visualizer.cell',
        'process_visualizer.discovery',
        'process_visualizer.generate',
        'process_visualizer.generate.ros1_packages',
        'process_visualizer.generate.ros1_packages.ament_index_python',
        'process_visualizer.gui',
        'process_visualizer.gui.models',
        'process_visualizer.gui.views',
        'process_visualizer.launching',
        'process_visualizer.motion',
        'process_visualizer.nodes',
    ],
))
