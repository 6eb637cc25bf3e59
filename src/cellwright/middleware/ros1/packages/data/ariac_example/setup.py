"""Tells catkin where the Python module lies."""

from catkin_pkg.python_setup import generate_distutils_setup
from setuptools import setup

setup(**generate_distutils_setup(packages=["ariac_example"], package_dir={"": "src"}))
