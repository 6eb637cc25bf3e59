"""Controller manager of a cell in ROS 2: what it lists, what it accepts, and what it refuses with a reason."""

from __future__ import annotations

from typing import Any

import pytest

from cellwright.cell.controllers import HARDWARE, STATES, STRICT, TRAJECTORIES, TYPES, ControlledArm, ControllerManager
from cellwright.cell.interface.parameters import parameters
from cellwright.config.arm import ARM_JOINTS
from tests.support.cells import ARM_ONLY, JOINTS

BEST_EFFORT, AUTO, FORCE_AUTO = 1, 3, 4
ALWAYS = "arm_controller is always active in this cell"


def arm() -> dict[str, Any]:
    cell: Any = parameters(ARM_ONLY, competition=False)
    found: dict[str, Any] = cell["ariac"]["arm"]
    return found


@pytest.fixture
def manager() -> ControllerManager:
    return ControllerManager(500, {HARDWARE: ControlledArm(ARM_JOINTS, arm)})


def answer(manager: ControllerManager, service: str, **request: Any) -> dict[str, Any]:
    return manager.services[f"controllers/{service}"](request)


def test_nodes_have_parameters_of_both_controllers_and_those_of_trial(manager: ControllerManager) -> None:
    nodes = answer(manager, "Nodes")
    assert set(nodes) == {"controller_manager", TRAJECTORIES}
    listed = answer(manager, "ListControllers")["controller"]
    assert {each["name"]: each["type"] for each in listed} == TYPES
    assert all(nodes["controller_manager"][name] == {"type": kind} for name, kind in TYPES.items())
    assert nodes["controller_manager"]["update_rate"] == 500
    mine = nodes[TRAJECTORIES]
    assert mine["joints"] == list(JOINTS)
    assert mine["constraints"] == arm()["constraints"]
    assert "elbow_joint" in mine["constraints"]
    claimed = [f"{joint}/{kind}" for joint in mine["joints"] for kind in mine["command_interfaces"]]
    assert listed[0]["claimed_interfaces"] == claimed
    required = [f"{joint}/{kind}" for joint in mine["joints"] for kind in mine["state_interfaces"]]
    assert listed[0]["required_state_interfaces"] == required


def test_lists_have_base_class_of_each_type_and_one_active_component(manager: ControllerManager) -> None:
    types = answer(manager, "ListControllerTypes")
    assert types["types"] == list(TYPES.values())
    assert types["base_classes"] == ["controller_interface::ControllerInterface"] * len(TYPES)
    (component,) = answer(manager, "ListHardwareComponents")["component"]
    assert component["state"] == {"id": 3, "label": "active"}
    interfaces = answer(manager, "ListHardwareInterfaces")
    assert {name: component[name] for name in interfaces} == interfaces
    activity = answer(manager, "Activity")
    assert [each["name"] for each in activity["controllers"]] == list(TYPES)
    assert [each["name"] for each in activity["hardware_components"]] == [component["name"]]
    assert {each["state"]["label"] for states in activity.values() for each in states} == {"active"}


@pytest.mark.parametrize(
    ("activate", "deactivate", "strictness", "reason"),
    [
        ([], [], STRICT, ""),
        ([TRAJECTORIES], [], STRICT, "arm_controller is active already"),
        ([TRAJECTORIES], [], BEST_EFFORT, ""),
        ([TRAJECTORIES], [], 0, ""),
        (["mine"], [], STRICT, "no controller 'mine'; there are arm_controller and joint_state_broadcaster"),
        ([], ["mine"], STRICT, "no controller 'mine'"),
        (["mine", STATES], ["other"], BEST_EFFORT, ""),
        (["mine"], [], AUTO, ""),
        (["mine"], [], FORCE_AUTO, ""),
        ([], [TRAJECTORIES], BEST_EFFORT, ALWAYS),
        ([], [TRAJECTORIES], STRICT, ALWAYS),
        ([], [TRAJECTORIES], FORCE_AUTO, ALWAYS),
        ("arm_controller", [], STRICT, "controllers must be given as lists"),
        ([{}], [], STRICT, "no controller {}"),
    ],
)
def test_switch_has_strictness_of_ros2_control(
    manager: ControllerManager, activate: Any, deactivate: Any, strictness: int, reason: str
) -> None:
    request = {"activate_controllers": activate, "deactivate_controllers": deactivate, "strictness": strictness}
    found = answer(manager, "SwitchController", **request)
    assert found["ok"] is not bool(reason)
    assert found["message"].startswith(reason)


def test_configured_controller_can_be_activated_once(manager: ControllerManager) -> None:
    """As the spawner does: load, configure, activate with strictness STRICT."""
    for name in (STATES, TRAJECTORIES):
        assert answer(manager, "LoadController", name=name)["ok"]
        assert answer(manager, "ConfigureController", name=name)["ok"]
    both = {"activate_controllers": [STATES, TRAJECTORIES], "strictness": STRICT}
    assert answer(manager, "SwitchController", **both)["ok"]
    assert not answer(manager, "SwitchController", **both)["ok"]
    assert [each["state"] for each in answer(manager, "ListControllers")["controller"]] == ["active"] * 2


@pytest.mark.parametrize(
    ("service", "request_", "reason"),
    [
        ("LoadController", {"name": "mine"}, "no controller 'mine'"),
        ("LoadController", {"name": []}, "no controller []"),
        ("ConfigureController", {}, "no controller None"),
        ("CleanupController", {"name": TRAJECTORIES}, ALWAYS),
        ("CleanupController", {"name": "mine"}, "no controller 'mine'"),
        ("UnloadController", {"name": TRAJECTORIES}, ALWAYS),
        ("UnloadController", {"name": {}}, "no controller {}"),
        ("ReloadControllerLibraries", {"force_kill": True}, ALWAYS),
        ("SetHardwareComponentState", {"name": "legs"}, "no hardware component 'legs'; there is arm"),
        ("SetHardwareComponentState", {"name": HARDWARE, "target_state": {"id": 2}}, "arm is always active"),
        ("SetHardwareComponentState", {"name": HARDWARE, "target_state": 3}, "arm is always active"),
        (
            "SetHardwareComponentState",
            {"name": HARDWARE, "target_state": {"id": 2, "label": "active"}},
            "arm is always active",
        ),
    ],
)
def test_changes_are_refused_with_reason(
    manager: ControllerManager, service: str, request_: dict[str, Any], reason: str
) -> None:
    found = answer(manager, service, **request_)
    assert found["ok"] is False
    assert found["message"].startswith(reason)


@pytest.mark.parametrize("target", [{"id": 3, "label": ""}, {"id": 0, "label": "active"}])
def test_arm_can_be_set_to_active_which_it_is(manager: ControllerManager, target: dict[str, Any]) -> None:
    found = answer(manager, "SetHardwareComponentState", name=HARDWARE, target_state=target)
    assert found == {"ok": True, "state": {"id": 3, "label": "active"}}
