"""Controllers of a cell as tools of ros2_control ask for them: the services of a controller manager, with JSON.

The fields are those of `controller_manager_msgs`. Both controllers are always active, as in the 2017 competition.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cellwright.config.layout import ARM_JOINTS

TRAJECTORIES, STATES = "arm_controller", "joint_state_broadcaster"


class ControllerManager:
    """Controller manager of the arm.

    Example:
        >>> manager = ControllerManager(500)
        >>> [each["name"] for each in manager.list_controllers({})["controller"]]
        ['arm_controller', 'joint_state_broadcaster']
        >>> manager.switch_controller({"deactivate_controllers": ["arm_controller"]})["ok"]
        False

    Args:
        rate: rate of control [Hz].
    """

    def __init__(self, rate: int) -> None:
        self._rate = rate
        self._commands = [f"{joint}/position" for joint in ARM_JOINTS]
        self._states = [f"{joint}/{kind}" for joint in ARM_JOINTS for kind in ("position", "velocity", "effort")]

    @property
    def services(self) -> dict[str, Callable[[dict[str, Any]], dict[str, Any]]]:
        """Handlers by the names of their services on a server."""
        return {
            "controllers/ListControllers": self.list_controllers,
            "controllers/ListHardwareInterfaces": self.list_hardware_interfaces,
            "controllers/SwitchController": self.switch_controller,
        }

    def list_controllers(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return both controllers."""
        trajectories = {
            "name": TRAJECTORIES,
            "type": "joint_trajectory_controller/JointTrajectoryController",
            "claimed_interfaces": self._commands,
            "required_command_interfaces": self._commands,
            "required_state_interfaces": [each for each in self._states if not each.endswith("/effort")],
        }
        broadcaster = {
            "name": STATES,
            "type": "joint_state_broadcaster/JointStateBroadcaster",
            "required_state_interfaces": self._states,
        }
        return {
            "controller": [
                {**each, "state": "active", "update_rate": self._rate} for each in (trajectories, broadcaster)
            ]
        }

    def list_hardware_interfaces(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the interfaces of the joints; the controller of trajectories has claimed all commands."""
        found = {"data_type": "double", "is_available": True}
        return {
            "command_interfaces": [{"name": name, "is_claimed": True, **found} for name in self._commands],
            "state_interfaces": [{"name": name, "is_claimed": False, **found} for name in self._states],
        }

    def switch_controller(self, request: dict[str, Any]) -> dict[str, Any]:
        """Refuse a change: the controllers stay active. To activate an active one changes nothing and succeeds."""
        asked = {name: request.get(f"{name}_controllers") or [] for name in ("activate", "deactivate")}
        if not all(isinstance(each, list) for each in asked.values()):
            return {"ok": False, "message": "controllers must be given as lists of names"}
        unknown = [name for names in asked.values() for name in names if name not in (TRAJECTORIES, STATES)]
        if unknown:
            return {"ok": False, "message": f"no controller {unknown[0]!r:.60}; there are {TRAJECTORIES} and {STATES}"}
        if asked["deactivate"]:
            return {"ok": False, "message": f"{asked['deactivate'][0]} is always active in this cell"}
        return {"ok": True, "message": ""}
