"""Controllers of a cell as tools of ros2_control ask for them: the services of a controller manager, with JSON.

The fields are those of `controller_manager_msgs`. Both controllers are always active, as in the 2017 competition. What
would change that is refused: `ok` is false, and `message` has the reason, also where the type has no such field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

MANAGER, TRAJECTORIES, STATES, HARDWARE = "controller_manager", "arm_controller", "joint_state_broadcaster", "arm"

TYPES = {
    TRAJECTORIES: "joint_trajectory_controller/JointTrajectoryController",
    STATES: "joint_state_broadcaster/JointStateBroadcaster",
}
"""Type of each controller."""

STRICT = 2
"""Value of `strictness` with which a request fails as a whole; with all others, unknown names are skipped."""

_ACTIVE = {"id": 3, "label": "active"}  # a lifecycle_msgs/State
_BASE = "controller_interface::ControllerInterface"
_STAYS = "is always active in this cell"

Service = Callable[[dict[str, Any]], dict[str, Any]]


class ControllerManager:
    """Controller manager of the arm.

    Example:
        >>> manager = ControllerManager(500, ("shoulder", "elbow"), dict)
        >>> [each["name"] for each in manager.list_controllers({})["controller"]]
        ['arm_controller', 'joint_state_broadcaster']
        >>> manager.switch_controller({"deactivate_controllers": ["arm_controller"]})["ok"]
        False

    Args:
        rate: rate of control [Hz].
        joints: joints of the arm, base first.
        arm: returns the parameters of the arm's controller in ROS 1, nested.
    """

    def __init__(self, rate: int, joints: Sequence[str], arm: Callable[[], Mapping[str, Any]]) -> None:
        self._rate = rate
        self._arm = arm
        self._commands = [f"{joint}/position" for joint in joints]
        self._states = [f"{joint}/{kind}" for joint in joints for kind in ("position", "velocity", "effort")]
        self._configured: set[str] = set()
        """Controllers that were configured, and may be activated once: the steps in which tools start a controller."""

    @property
    def services(self) -> dict[str, Service]:
        """Handlers by the names of their services on a server."""
        return {
            "controllers/Nodes": self.nodes,
            "controllers/Activity": self.activity,
            "controllers/ListControllers": self.list_controllers,
            "controllers/ListControllerTypes": self.list_controller_types,
            "controllers/ListHardwareComponents": self.list_hardware_components,
            "controllers/ListHardwareInterfaces": self.list_hardware_interfaces,
            "controllers/SwitchController": self.switch_controller,
            "controllers/LoadController": self.load_controller,
            "controllers/ConfigureController": self.configure_controller,
            "controllers/CleanupController": self.refuse_end,
            "controllers/UnloadController": self.refuse_end,
            "controllers/ReloadControllerLibraries": self.reload_controller_libraries,
            "controllers/SetHardwareComponentState": self.set_hardware_component_state,
        }

    def nodes(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the nodes of ros2_control with their parameters, nested."""
        arm = self._arm()
        shared = ("joints", "constraints", "allow_partial_joints_goal", "state_publish_rate", "action_monitor_rate")
        return {
            MANAGER: {"update_rate": self._rate, **{name: {"type": kind} for name, kind in TYPES.items()}},
            TRAJECTORIES: {
                **{name: arm[name] for name in shared if name in arm},
                "command_interfaces": ["position"],
                "state_interfaces": ["position", "velocity"],
                "allow_nonzero_velocity_at_trajectory_end": False,
            },
        }

    def activity(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the states of both controllers and of the hardware."""
        return {
            "controllers": [{"name": name, "state": _ACTIVE} for name in TYPES],
            "hardware_components": [{"name": HARDWARE, "state": _ACTIVE}],
        }

    def list_controllers(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return both controllers."""
        trajectories = {
            "name": TRAJECTORIES,
            "claimed_interfaces": self._commands,
            "required_command_interfaces": self._commands,
            "required_state_interfaces": [each for each in self._states if not each.endswith("/effort")],
        }
        broadcaster = {"name": STATES, "required_state_interfaces": self._states}
        return {
            "controller": [
                {**each, "type": TYPES[str(each["name"])], "state": "active", "update_rate": self._rate}
                for each in (trajectories, broadcaster)
            ]
        }

    def list_controller_types(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the types of both controllers."""
        return {"types": [*TYPES.values()], "base_classes": [_BASE] * len(TYPES)}

    def list_hardware_components(self, request: dict[str, Any]) -> dict[str, Any]:
        """Return the arm, the only component."""
        arm = {"name": HARDWARE, "type": "system", "plugin_name": "cellwright", "rw_rate": self._rate, "state": _ACTIVE}
        return {"component": [{**arm, **self.list_hardware_interfaces(request)}]}

    def list_hardware_interfaces(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the interfaces of the joints; the controller of trajectories has claimed all commands."""
        found = {"data_type": "double", "is_available": True}
        return {
            "command_interfaces": [{"name": name, "is_claimed": True, **found} for name in self._commands],
            "state_interfaces": [{"name": name, "is_claimed": False, **found} for name in self._states],
        }

    def switch_controller(self, request: dict[str, Any]) -> dict[str, Any]:
        """Refuse a change: the controllers stay active.

        If strict, unknown controllers are refused, and so are active ones to be activated: but not those that were just
        configured, since tools start a controller in these two steps.
        """
        asked = {name: request.get(f"{name}_controllers") or [] for name in ("activate", "deactivate")}
        if not all(isinstance(each, list) for each in asked.values()):
            return _refusal("controllers must be given as lists of names")
        known = [name for name in asked["deactivate"] if _is_known(name)]
        if known:
            return _refusal(f"{known[0]} {_STAYS}")
        starting = {name for name in asked["activate"] if _is_known(name)}
        if request.get("strictness") == STRICT:
            unknown = [name for names in asked.values() for name in names if not _is_known(name)]
            if unknown:
                return _unknown(unknown[0])
            if running := sorted(starting - self._configured):
                return _refusal(f"{running[0]} is active already; ask with strictness BEST_EFFORT to ignore that")
        self._configured -= starting
        return {"ok": True, "message": ""}

    def load_controller(self, request: dict[str, Any]) -> dict[str, Any]:
        """Accept to load a controller that is there, and refuse any other."""
        name = request.get("name")
        return {"ok": True} if _is_known(name) else _unknown(name)

    def configure_controller(self, request: dict[str, Any]) -> dict[str, Any]:
        """Accept to configure a controller, which changes nothing: it stays active."""
        name = request.get("name")
        if not _is_known(name):
            return _unknown(name)
        self._configured.add(str(name))
        return {"ok": True}

    def refuse_end(self, request: dict[str, Any]) -> dict[str, Any]:
        """Refuse to clean up or unload a controller."""
        name = request.get("name")
        return _refusal(f"{name} {_STAYS}") if _is_known(name) else _unknown(name)

    def reload_controller_libraries(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Refuse to load the libraries again."""
        return _refusal(f"{TRAJECTORIES} {_STAYS}")

    def set_hardware_component_state(self, request: dict[str, Any]) -> dict[str, Any]:
        """Refuse another state of the arm than active; return the present one."""
        name, target = request.get("name"), request.get("target_state")
        if name != HARDWARE:
            return _refusal(f"no hardware component {name!r:.60}; there is {HARDWARE}")
        target = target if isinstance(target, dict) else {}
        is_active = target.get("id") == _ACTIVE["id"] or (not target.get("id") and target.get("label") == "active")
        return {**({"ok": True} if is_active else _refusal(f"{HARDWARE} {_STAYS}")), "state": _ACTIVE}


def _is_known(name: object) -> bool:
    return isinstance(name, str) and name in TYPES


def _refusal(reason: str) -> dict[str, Any]:
    return {"ok": False, "message": reason}


def _unknown(name: object) -> dict[str, Any]:
    return _refusal(f"no controller {name!r:.60}; there are {' and '.join(TYPES)}")
