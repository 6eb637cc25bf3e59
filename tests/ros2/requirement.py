"""Requirements of the marker `ros2`: a Python with rclpy and all interfaces of Cellwright.

If it is missing, a test is skipped with the reason; in CI it fails, so that a green build includes real ROS 2.
"""

import os
from functools import cache

from cellwright.middleware.ros2.host.installation import Installation, find
from cellwright.middleware.ros2.packages.environment import FOLDER_VARIABLE, environment_folder
from cellwright.util.errors import UsageError
from tests.support.required import cannot_run

HOW = "scripts/install-ros2 installs it"


@cache
def installation() -> Installation | None:
    """Return the installation of ROS 2; None if there is none."""
    try:
        return find()
    except UsageError:
        return None


@cache
def lacking() -> str | None:
    """Return the reason why tests with ROS 2 cannot run here; None if they can."""
    found = installation()
    if found is None:
        return f"no Python with rclpy: {HOW}"
    if found.missing_interfaces:
        return f"ROS 2 is here without {', '.join(found.missing_interfaces)}: {HOW}"
    return None


@cache
def _installation_of(distribution: str) -> Installation | None:
    """Return the installation of a distribution with all interfaces; None if there is none."""
    found = installation()
    if found is None or found.distribution != distribution:
        names = ("AMENT", "CELLWRIGHT_ROS2", "CMAKE_PREFIX_PATH", "PYTHON", "ROS")
        variables = {name: value for name, value in os.environ.items() if not name.startswith(names)}
        folder = environment_folder(distribution, variables)
        try:
            found = find({**variables, FOLDER_VARIABLE: str(folder)}, root=folder)
        except UsageError:
            return None
    return None if found.missing_interfaces else found


def installation_of(distribution: str) -> Installation:
    """Return the installation of a distribution: the one of all tests, or the environment of our own.

    Without it the test is skipped, and fails in CI.
    """
    found = _installation_of(distribution)
    if found is None:
        cannot_run(f"no ROS 2 {distribution}: scripts/install-ros2 {distribution} installs it", f"ROS 2 {distribution}")
    return found
