"""Controllers of a cell as tools of ros2_control ask for them: the services of a controller manager, with JSON.

The fields are those of `controller_manager_msgs`. All controllers are always active, as in the 2017 competition. What
would change that is refused: `ok` is false, and `message` has the reason, also where the type has no such field.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

MANAGER, STATES, HARDWARE = "controller_manager", "joint_state_broadcaster", "arm"

TRAJECTORIES = f"{HARDWARE}_controller"
"""Controller of an arm without a namespace; with one, that comes before `_controller`, and names the hardware."""

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


@dataclass(frozen=True)
class ControlledArm:
    """Arm under a controller of trajectories.

    Attributes:
        joints: its joints by their names in messages, base first.
        parameters: returns the parameters of its controller in ROS 1, nested.
    """

    joints: Sequence[str]
    parameters: Callable[[], Mapping[str, Any]]

    @property
    def commands(self) -> list[str]:
        """Names of the command interfaces."""
        return [f"{joint}/position" for joint in self.joints]

    @property
    def states(self) -> list[str]:
        """Names of the state interfaces."""
        return [f"{joint}/{kind}" for joint in self.joints for kind in ("position", "velocity", "effort")]

    @property
    def interfaces(self) -> dict[str, list[dict[str, Any]]]:
        """Interfaces in the fields of messages."""
        found = {"data_type": "double", "is_available": True}
        return {
            "command_interfaces": [{"name": name, "is_claimed": True, **found} for name in self.commands],
            "state_interfaces": [{"name": name, "is_claimed": False, **found} for name in self.states],
        }


class ControllerManager:
    """Controller manager of the arms.

    Example:
        >>> manager = ControllerManager(500, {"arm": ControlledArm(("shoulder", "elbow"), dict)})
        >>> [each["name"] for each in manager.list_controllers({})["controller"]]
        ['arm_controller', 'joint_state_broadcaster']
        >>> manager.switch_controller({"deactivate_controllers": ["arm_controller"]})["ok"]
        False

    Args:
        rate: rate of control [Hz].
        arms: the arms by the names of their hardware.
    """

    def __init__(self, rate: int, arms: Mapping[str, ControlledArm]) -> None:
        self._rate, self._arms = rate, arms
        self._types = {f"{name}_controller": TYPES[TRAJECTORIES] for name in arms} | {STATES: TYPES[STATES]}
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
        shared = ("joints", "constraints", "allow_partial_joints_goal", "state_publish_rate", "action_monitor_rate")
        manager = {"update_rate": self._rate, **{name: {"type": kind} for name, kind in self._types.items()}}
        nodes: dict[str, Any] = {MANAGER: manager}
        for name, arm in self._arms.items():
            values = arm.parameters()
            nodes[f"{name}_controller"] = {
                **{key: values[key] for key in shared if key in values},
                "command_interfaces": ["position"],
                "state_interfaces": ["position", "velocity"],
                "allow_nonzero_velocity_at_trajectory_end": False,
            }
        return nodes

    def activity(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the states of all controllers and of the hardware."""
        return {
            "controllers": [{"name": name, "state": _ACTIVE} for name in self._types],
            "hardware_components": [{"name": name, "state": _ACTIVE} for name in self._arms],
        }

    def list_controllers(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the controllers: those of the arms, then the broadcaster."""
        found: list[dict[str, Any]] = [
            {
                "name": f"{name}_controller",
                "claimed_interfaces": arm.commands,
                "required_command_interfaces": arm.commands,
                "required_state_interfaces": [each for each in arm.states if not each.endswith("/effort")],
            }
            for name, arm in self._arms.items()
        ]
        states = [each for arm in self._arms.values() for each in arm.states]
        found.append({"name": STATES, "required_state_interfaces": states})
        return {
            "controller": [
                {**each, "type": self._types[each["name"]], "state": "active", "update_rate": self._rate}
                for each in found
            ]
        }

    def list_controller_types(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the types of controllers."""
        return {"types": [*TYPES.values()], "base_classes": [_BASE] * len(TYPES)}

    def list_hardware_components(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the arms, each a component."""
        component = {"type": "system", "plugin_name": "cellwright", "rw_rate": self._rate, "state": _ACTIVE}
        return {"component": [{"name": name, **component, **arm.interfaces} for name, arm in self._arms.items()]}

    def list_hardware_interfaces(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Return the interfaces of the joints; the controllers of trajectories have claimed all commands."""
        found: dict[str, Any] = {"command_interfaces": [], "state_interfaces": []}
        for arm in self._arms.values():
            for name, interfaces in arm.interfaces.items():
                found[name] += interfaces
        return found

    def switch_controller(self, request: dict[str, Any]) -> dict[str, Any]:
        """Refuse a change: the controllers stay active.

        If strict, unknown controllers are refused, and so are active ones to be activated: but not those that were just
        configured, since tools start a controller in these two steps.
        """
        asked = {name: request.get(f"{name}_controllers") or [] for name in ("activate", "deactivate")}
        if not all(isinstance(each, list) for each in asked.values()):
            return _refusal("controllers must be given as lists of names")
        known = [name for name in asked["deactivate"] if self._knows(name)]
        if known:
            return _refusal(f"{known[0]} {_STAYS}")
        starting = {name for name in asked["activate"] if self._knows(name)}
        if request.get("strictness") == STRICT:
            unknown = [name for names in asked.values() for name in names if not self._knows(name)]
            if unknown:
                return self._unknown(unknown[0])
            if running := sorted(starting - self._configured):
                return _refusal(f"{running[0]} is active already; ask with strictness BEST_EFFORT to ignore that")
        self._configured -= starting
        return {"ok": True, "message": ""}

    def load_controller(self, request: dict[str, Any]) -> dict[str, Any]:
        """Accept to load a controller that is there, and refuse any other."""
        name = request.get("name")
        return {"ok": True} if self._knows(name) else self._unknown(name)

    def configure_controller(self, request: dict[str, Any]) -> dict[str, Any]:
        """Accept to configure a controller, which changes nothing: it stays active."""
        name = request.get("name")
        if not self._knows(name):
            return self._unknown(name)
        self._configured.add(str(name))
        return {"ok": True}

    def refuse_end(self, request: dict[str, Any]) -> dict[str, Any]:
        """Refuse to clean up or unload a controller."""
        name = request.get("name")
        return _refusal(f"{name} {_STAYS}") if self._knows(name) else self._unknown(name)

    def reload_controller_libraries(self, _request: dict[str, Any]) -> dict[str, Any]:
        """Refuse to load the libraries again."""
        return _refusal(f"{next(iter(self._types))} {_STAYS}")

    def set_hardware_component_state(self, request: dict[str, Any]) -> dict[str, Any]:
        """Refuse another state of an arm than active; return the present one."""
        name, target = request.get("name"), request.get("target_state")
        if not isinstance(name, str) or name not in self._arms:
            return _refusal(f"no hardware component {name!r:.60}; there is {' and '.join(self._arms)}")
        target = target if isinstance(target, dict) else {}
        is_active = target.get("id") == _ACTIVE["id"] or (not target.get("id") and target.get("label") == "active")
        return {**({"ok": True} if is_active else _refusal(f"{name} {_STAYS}")), "state": _ACTIVE}

    def _knows(self, name: object) -> bool:
        return isinstance(name, str) and name in self._types

    def _unknown(self, name: object) -> dict[str, Any]:
        return _refusal(f"no controller {name!r:.60}; there are {' and '.join(self._types)}")


def _refusal(reason: str) -> dict[str, Any]:
    return {"ok": False, "message": reason}
