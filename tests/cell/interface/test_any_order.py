"""Commands, time, resets and restores in any order: the state stays sound and the run goes on."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, ClassVar

import numpy as np
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import Bundle, RuleBasedStateMachine, initialize, invariant, rule

from cellwright.cell.cell import Cell
from cellwright.engine.clock import NANOSECONDS
from cellwright.engine.snapshot import Snapshot, restore_snapshot, take_snapshot
from cellwright.middleware.bus import Node
from cellwright.middleware.bus.refusals import MAX_KINDS
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import joint_state
from cellwright.middleware.messages.osrf_gear import AGVControlRequest, SubmitTrayRequest, VacuumGripperControlRequest
from cellwright.middleware.messages.std_srvs import SetBoolRequest, TriggerRequest
from cellwright.util.errors import CellwrightError
from tests.cell.interface.goals import goal
from tests.cell.interface.inputs import GEAR, TELEOP, Input, robot, state_hash, whole_cell
from tests.middleware.messages.random_messages import messages, spoiled
from tests.robot.robots import two_arms
from tests.support.cells import ABOVE_THE_ROD, INITIAL, TRAY_1, is_sound, way

BEYOND = 0.15
"""Distance [rad; m] beyond its range to which the greatest effort may press a joint."""


class Life(RuleBasedStateMachine):
    """State machine with the invariants of a cell and of a robot's node."""

    make: ClassVar[Callable[[], tuple[Node, list[str]]]]
    known: ClassVar[list[Input]]
    sensible: ClassVar[list[tuple[str, Any]]]

    snapshots = Bundle("snapshots")

    def __init__(self) -> None:
        super().__init__()
        self.served, self.lines = type(self).make()
        self.bus, self.simulation = self.served.bus, self.served.simulation
        self.reported: list[tuple[int, str]] = []

    @initialize()
    def begin(self) -> None:
        self.simulation.reset()
        self.lines.clear()
        self.refused = self.bus.refusals.total

    def give(self, each: Input, message: Any, node: str) -> None:
        before = self.bus.refusals.total
        try:
            each.give(self.bus, message, node)
        except CellwrightError:
            assert self.bus.refusals.total - before in (0, 1)  # a service may fail without being refused
        self.refused += self.bus.refusals.total - before
        self.reported += [(self.simulation.now, line) for line in self.lines]
        self.lines.clear()

    @rule(data=st.data(), node=st.sampled_from(["/a", "/b", ""]), is_spoiled=st.booleans())
    def say_anything(self, data: st.DataObject, node: str, is_spoiled: bool) -> None:
        each = data.draw(st.sampled_from(self.known))
        self.give(each, data.draw((spoiled if is_spoiled else messages)(each.type_name)), node)

    @rule(data=st.data(), node=st.sampled_from(["/a", "/b"]))
    def say_something_sensible(self, data: st.DataObject, node: str) -> None:
        name, message = data.draw(st.sampled_from(self.sensible))
        self.give(next(each for each in self.known if each.name == name), message, node)

    @rule(ticks=st.integers(1, 40))
    def let_time_pass(self, ticks: int) -> None:
        before = self.simulation.clock.tick
        for _ in range(ticks):
            self.simulation.step()
        assert self.simulation.clock.tick == before + ticks

    @rule()
    def start_again(self) -> None:
        self.simulation.reset()
        self.reported.clear()
        assert self.simulation.now == 0

    @rule(target=snapshots)
    def keep(self) -> tuple[Snapshot, str]:
        return take_snapshot(self.simulation), state_hash(self.served)

    @rule(kept=snapshots)
    def go_back(self, kept: tuple[Snapshot, str]) -> None:
        restore_snapshot(self.simulation, kept[0])
        self.reported.clear()
        assert state_hash(self.served) == kept[1]

    @invariant()
    def every_refusal_is_counted(self) -> None:
        if hasattr(self, "refused"):
            assert self.bus.refusals.total == self.refused

    @invariant()
    def no_source_is_reported_too_often(self) -> None:
        times: dict[str, list[int]] = {}
        for now, line in self.reported:
            assert line.isprintable()
            if line.startswith("refused "):
                times.setdefault(line.split(": ")[0], []).append(now)
        for source, each in times.items():
            assert all(b - a >= NANOSECONDS for a, b in zip(each, each[MAX_KINDS:], strict=False)), source

    @invariant()
    def joints_stay_within_their_range(self) -> None:
        model, data = self.simulation.model, self.simulation.data
        assert np.isfinite(data.qpos).all()
        assert np.isfinite(data.qvel).all()
        for joint in np.flatnonzero(model.jnt_limited):
            low, high = model.jnt_range[joint]
            assert low - BEYOND <= data.qpos[model.jnt_qposadr[joint]] <= high + BEYOND, model.joint(joint).name


@cache
def cell_and_lines() -> tuple[Cell, list[str]]:
    lines: list[str] = []
    return whole_cell(report=lines.append), lines


class LifeOfACell(Life):
    """The cell, with parts to grip, a kit to send off and all cheats allowed."""

    make = cell_and_lines
    known = GEAR
    sensible: ClassVar[list[tuple[str, Any]]] = [
        ("/ariac/start_competition", TriggerRequest()),
        ("/ariac/end_competition", TriggerRequest()),
        ("/ariac/arm/command", way(INITIAL, ABOVE_THE_ROD, each=0.05)),
        ("/ariac/arm/follow_joint_trajectory/goal", goal(way(ABOVE_THE_ROD), "one")),
        ("/ariac/arm/follow_joint_trajectory/goal", goal(way(INITIAL), "two", tolerance=0.01)),
        ("/ariac/gripper/control", VacuumGripperControlRequest(enable=True)),
        ("/ariac/agv1", AGVControlRequest("order_0_kit_0")),
        ("/ariac/submit_tray", SubmitTrayRequest(TRAY_1, "order_0_kit_0")),
        ("/ariac/kit_tray_1/clear_tray", TriggerRequest()),
    ]

    @invariant()
    def the_score_is_one(self) -> None:
        cell = cell_and_lines()[0]
        assert is_sound(cell)
        assert 0.0 <= cell.competition.score().total <= 6.0


@cache
def robot_and_lines() -> tuple[Node, list[str]]:
    lines: list[str] = []
    return robot(report=lines.append), lines


ENDS = [(joint.name, limits) for joint in two_arms().robot.movable if (limits := joint.limits) is not None]


class LifeOfARobot(Life):
    """The robot's node."""

    make = robot_and_lines
    known = TELEOP
    sensible: ClassVar[list[tuple[str, Any]]] = [
        ("/io_teleop/joint_cmd", joint_state([name for name, _ in ENDS], [100.0] * len(ENDS), time=0)),
        ("/io_teleop/joint_cmd", joint_state([name for name, _ in ENDS], [-100.0] * len(ENDS), time=0)),
        ("/io_teleop/emergency_stop", TYPES.message("std_msgs/Bool")(True)),  # type: ignore[call-arg]
        ("/io_teleop/clear_emergency_stop", TriggerRequest()),
        ("/io_teleop/set_enabled", SetBoolRequest(data=True)),
        ("/io_teleop/set_enabled", SetBoolRequest(data=False)),
        ("/io_teleop_reset_robot", TriggerRequest()),
    ]


FEW = settings(max_examples=25, stateful_step_count=25)
TestLifeOfACell = LifeOfACell.TestCase
TestLifeOfACell.settings = FEW
TestLifeOfARobot = LifeOfARobot.TestCase
TestLifeOfARobot.settings = FEW
