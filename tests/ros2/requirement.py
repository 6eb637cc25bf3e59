"""Requirements of the marker `ros2`: a Python with rclpy and all interfaces of Cellwright.

If it is missing, a test is skipped with the reason; in CI it fails, so that a green build includes real ROS 2.
"""

from functools import cache

from cellwright.middleware.ros2.host.installation import Installation, find
from cellwright.util.errors import UsageError

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
