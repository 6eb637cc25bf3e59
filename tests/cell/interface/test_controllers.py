"""Controller manager of ROS 1: what it lists, and what it refuses with a reason."""

from __future__ import annotations

from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.interface.parameters import parameters
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.controller_manager_msgs import (
    ListControllersRequest,
    ListControllerTypesRequest,
    LoadControllerRequest,
    ReloadControllerLibrariesRequest,
    SwitchControllerRequest,
    UnloadControllerRequest,
)
from tests.support.cells import ARM_ONLY, JOINTS, call

STRICT, BEST_EFFORT = SwitchControllerRequest.STRICT, SwitchControllerRequest.BEST_EFFORT


def test_controllers_have_names_and_types_of_their_parameters() -> None:
    cell = Cell(ARM_ONLY)
    listed = call(cell, "controller_manager/list_controllers", ListControllersRequest()).controller
    assert [(each.name, each.state) for each in listed] == [("arm", "running"), ("joint_state_controller", "running")]
    stated: Any = parameters(ARM_ONLY, competition=True)["ariac"]
    assert [each.type for each in listed] == [stated[each.name]["type"] for each in listed]
    arm, states = (each.claimed_resources[0] for each in listed)
    assert (arm.hardware_interface, arm.resources) == ("hardware_interface::EffortJointInterface", sorted(JOINTS))
    assert (states.hardware_interface, states.resources) == ("hardware_interface::JointStateInterface", [])
    types = call(cell, "controller_manager/list_controller_types", ListControllerTypesRequest())
    assert types.types == [each.type for each in listed]
    assert types.base_classes == ["controller_interface::ControllerBase"] * 2


@pytest.mark.parametrize(
    ("start", "stop", "strictness", "is_ok"),
    [
        ([], [], STRICT, True),
        (["arm"], [], STRICT, True),
        (["arm", "other"], [], BEST_EFFORT, True),
        (["arm", "other"], [], STRICT, False),
        ([], ["other"], STRICT, False),
        ([], ["arm"], BEST_EFFORT, False),
        (["arm"], ["joint_state_controller"], STRICT, False),
    ],
)
def test_switch_succeeds_only_if_nothing_would_change(
    start: list[str], stop: list[str], strictness: int, *, is_ok: bool
) -> None:
    lines: list[str] = []
    cell = Cell(ARM_ONLY, report=lines.append)
    before = cell.state_hash()
    answer = call(cell, "controller_manager/switch_controller", SwitchControllerRequest(start, stop, strictness))
    assert (answer.ok, len(lines)) == (is_ok, int(not is_ok))
    assert cell.state_hash() == before


@pytest.mark.parametrize(
    ("service", "request_", "reason"),
    [
        ("load_controller", LoadControllerRequest("arm"), "arm is loaded already"),
        (
            "load_controller",
            LoadControllerRequest("mine"),
            "no controller 'mine'; there are arm and joint_state_controller",
        ),
        ("unload_controller", UnloadControllerRequest("arm"), "arm is always running in this cell"),
        ("unload_controller", UnloadControllerRequest("mine"), "no controller 'mine'"),
        ("reload_controller_libraries", ReloadControllerLibrariesRequest(force_kill=True), "arm is always running"),
    ],
)
def test_changes_are_refused_with_reason(service: str, request_: Any, reason: str) -> None:
    lines: list[str] = []
    cell = Cell(ARM_ONLY, report=lines.append)
    assert call(cell, f"controller_manager/{service}", request_).ok is False
    assert len(lines) == 1
    assert lines[0].startswith(f"refused /ariac/controller_manager/{service}")
    assert reason in lines[0]


def test_services_have_checksums_of_ros_control() -> None:
    """Those of the releases of 2017."""
    checksums = {
        "ListControllers": "1341feb2e63fa791f855565d0da950d8",
        "ListControllerTypes": "c1d4cd11aefa9f97ba4aeb5b33987f4e",
        "LoadController": "647e5c54b8d6468952d8d31f1efe96c0",
        "UnloadController": "647e5c54b8d6468952d8d31f1efe96c0",
        "SwitchController": "5e857dedf71d6f337975e15a1e7cfdd8",
    }
    assert {name: TYPES.md5(f"controller_manager_msgs/{name}") for name in checksums} == checksums
