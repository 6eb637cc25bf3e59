"""Commands of a policy at a robot's node: the recorded ones are checked against its answers, and a change is named."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest

from cellwright.clients.operators.robot import GRIPPER_COMMAND, JOINT_COMMAND
from cellwright.clients.policies.report import TOPIC
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import Bool, String
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.recording.format.commands import Command, note_commands
from cellwright.recording.replay.policies import EpisodeCheck
from cellwright.robot.node import RobotNode, RobotSettings
from tests.clients.policies.test_agent import Scripted, spec
from tests.clients.policies.test_robot_workplace import ROBOT, Drive, going, key_map

STEPS = "{channels: [right_1, left_2], mode: delta, scale: 0.02}, {gripper: right, open: 1, closed: 0}"
TIP = "{pose: left, mode: delta, rotation: axis_angle, frame: world, scale: 0.01, turn_scale: 0.05}"


def stepping(_observation: Any, number: int) -> Sequence[Sequence[float]]:
    """Step two joints, and close a gripper little by little."""
    return [[1.0, -0.5, 1.0 - 0.1 * (number % 10)]] * 4


def tipping(_observation: Any, number: int) -> Sequence[Sequence[float]]:
    """Step a tip forward, and turn it at every other request."""
    return [[1.0, 0.5, 0.0, 0.0, 0.0, float(number % 2)]] * 4


def driven(infer: Any, at: Mapping[float, Callable[[RobotNode], object]] = {}, **options: Any) -> list[Command]:
    """Return the commands of an episode of 1.5 s; `at` has calls by simulation time [s]."""
    drive, found = Drive(), list[Command]()
    note_commands(drive.node.bus, drive.node.simulation.clock, found.append)
    calls = {time: lambda act=act: act(drive.node) for time, act in at.items()}
    drive.work(Scripted(infer), spec(**options), 1.5, calls)
    return found


def fault(commands: Sequence[Command]) -> str:
    """Return the fault that is found as the commands run again; empty if there is none."""
    node = RobotNode(ROBOT, RobotSettings(sim_time=True))
    check = EpisodeCheck(node)
    for command in commands:
        node.simulation.step_until(node.simulation.clock.time_of(command.tick))
        command.carry_out(node.bus)
        check.take(command)
    assert check.requests > 2 or check.fault
    return check.fault


def moved(command: Command, name: str, by: float) -> Command:
    """Return a command with another target of a joint or a gripper."""
    message = command.message()
    message.position = message.position.copy()  # what was read is read-only
    message.position[list(message.name).index(name)] += by
    return replace(command, data=TYPES.to_cdr(message))


def of_topic(commands: Sequence[Command], topic: str) -> list[int]:
    return [place for place, each in enumerate(commands) if each.name == topic]


@pytest.mark.parametrize(
    ("infer", "actions", "latency"),
    [(going(0, 0.5), "", "70ms"), (stepping, STEPS, ""), (stepping, STEPS, "normal:60ms,20ms"), (tipping, TIP, "40ms")],
)
def test_commands_of_each_kind_follow_from_the_answers(infer: Any, actions: str, latency: str, tmp_path: Path) -> None:
    options: dict[str, Any] = {"map_file": key_map(tmp_path, actions)} if actions else {}
    commands = driven(infer, latency=latency, **options)
    assert len(of_topic(commands, JOINT_COMMAND)) > 15
    assert fault(commands) == ""


@pytest.mark.parametrize(
    ("topic", "name", "number", "said"),
    [
        (JOINT_COMMAND, "right_1", 0, "request 0: right_1 must go to 0.0[12].* at tick 0 "),
        (JOINT_COMMAND, "left_2", 9, "request 4: left_2 must go to 0.[45].* at tick 108 "),
        (GRIPPER_COMMAND, "gripper_0", 2, "request .: gripper_0 must go to 0.[123] at tick .* "),
    ],
)
def test_first_target_that_was_changed_is_named(topic: str, name: str, number: int, said: str, tmp_path: Path) -> None:
    commands = driven(stepping, map_file=key_map(tmp_path, STEPS), chunk=2)
    place = of_topic(commands, topic)[number]
    commands[place] = moved(commands[place], name, 0.01)
    assert re.match(said, fault(commands))


def test_command_that_is_missing_is_named(tmp_path: Path) -> None:
    commands = driven(stepping, map_file=key_map(tmp_path, STEPS), chunk=2)
    del commands[of_topic(commands, JOINT_COMMAND)[5]]
    assert fault(commands) == "request 2: action 1 must act at tick 60 (got no command)"


def test_latency_that_was_edited_and_not_run_fails_by_its_commands() -> None:
    commands = driven(going(0, 0.5), latency="60ms", chunk=4)
    for place in of_topic(commands, TOPIC):
        document = json.loads(commands[place].message().data)
        if rules := document.get("rules"):
            rules["latency"] = "110ms"
        if request := document.get("request"):
            ready = request["observed"] + 27  # 26.4 ticks of 1/240 s
            first = -(-ready // 12) * 12
            index = (first - request["observed"]) // 12
            request |= {"latency": 27, "ready": ready, "first": first, "index": index}
        commands[place] = replace(commands[place], data=TYPES.to_cdr(String(json.dumps(document))))
    assert fault(commands) == "request 0: no action acts at tick 24 (got a command)"


def stop(node: RobotNode) -> None:
    node.bus.publish("/io_teleop/emergency_stop", Bool(True), node="/operator")


def clear(node: RobotNode) -> None:
    node.bus.call("/io_teleop/clear_emergency_stop", TriggerRequest(), node="/operator")


def test_stopped_node_needs_no_commands_and_steps_go_on_from_where_it_is_then(tmp_path: Path) -> None:
    commands = driven(stepping, {0.5: stop, 1.0: clear}, map_file=key_map(tmp_path, STEPS))
    sent = of_topic(commands, JOINT_COMMAND)
    ticks = [commands[place].tick for place in sent]
    gaps = [later - tick for tick, later in pairwise(ticks)]
    resumed = gaps.index(max(gaps)) + 1
    assert gaps[resumed - 1] > 100
    assert fault(commands) == ""
    commands[sent[resumed]] = moved(commands[sent[resumed]], "right_1", 0.01)
    assert "right_1 must go to" in fault(commands)


def test_commands_of_others_are_no_concern_of_the_policys(tmp_path: Path) -> None:
    commands = driven(stepping, map_file=key_map(tmp_path, STEPS))
    place = of_topic(commands, JOINT_COMMAND)[3]
    commands.insert(place, replace(moved(commands[place], "right_1", 0.2), node="/operator"))
    assert fault(commands) == ""
