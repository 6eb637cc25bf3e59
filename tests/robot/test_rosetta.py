"""Tests of contracts for rosetta, against the rules by which its version 0.2.0 accepts one."""

from __future__ import annotations

from functools import partial
from typing import Any

import pytest
import yaml

from cellwright import RobotNode, load_robot
from cellwright.middleware.messages.conversions import joint_state
from cellwright.robot.rosetta import rosetta_contract
from cellwright.util.errors import UsageError

DECODED = ("sensor_msgs/msg/JointState", "sensor_msgs/msg/Image")
QOS = {
    "reliability": ("reliable", "best_effort"),
    "durability": ("volatile", "transient_local"),
    "history": ("keep_last",),
}
TOP = ("robot_type", "robot_interface", "fps", "observations", "actions", "adjunct")


def check_source(source: dict[str, Any], *, is_action: bool, is_picture: bool) -> None:
    """Require of a source what rosetta does when it loads a contract."""
    assert {*source} == {"channel", "align", *(["apply"] if is_picture else ["select"])}
    check_channel(source["channel"], is_action=is_action)
    assert source["channel"]["type"] == DECODED[is_picture]
    assert source["align"] == {"strategy": "hold", "timeline": "header"}
    if is_picture:
        height, width = source["apply"]["resize"]
        assert 0 < height < width
    else:
        assert source["select"]
        assert len({*source["select"]}) == len(source["select"])
        assert all(path.startswith("position.") for path in source["select"])


def check_channel(channel: dict[str, Any], *, is_action: bool = False) -> None:
    assert {*channel} == {"topic", "type", "qos", *(["safety"] if is_action else [])}
    assert channel["topic"].startswith("/")
    assert channel["type"].count("/msg/") == 1
    for name, known in QOS.items():
        assert channel["qos"][name] in known
    assert channel["qos"]["depth"] > 0
    assert not is_action or (channel["safety"], channel["qos"]["reliability"]) == ("hold", "best_effort")


@pytest.mark.parametrize("name", ["tandem", "qinglong"])
def test_contract_keeps_the_rules_of_rosetta(name: str) -> None:
    text = rosetta_contract(load_robot(name))
    assert "&id" not in text  # rosetta reads values, not references
    contract = yaml.safe_load(text)
    assert tuple(contract) == TOP
    assert (contract["robot_interface"], contract["fps"]) == ("ros2", 30)
    pictures = [key for key in contract["observations"] if key.startswith("observation.images.")]
    assert {*contract["observations"]} - {*pictures} == {
        "observation.state"
    }  # one numeric key, for a policy of LeRobot
    assert {*contract["actions"]} == {"action"}
    for source in contract["observations"]["observation.state"]:
        check_source(source, is_action=False, is_picture=False)
    for key in pictures:
        check_source(contract["observations"][key], is_action=False, is_picture=True)
    for source in contract["actions"]["action"]:
        check_source(source, is_action=True, is_picture=False)
    for each in contract["adjunct"]:
        assert {*each} == {"channel"}
        check_channel(each["channel"])


def test_selected_names_are_those_that_the_node_publishes_and_commands() -> None:
    contract = yaml.safe_load(rosetta_contract(load_robot("tandem")))
    node = RobotNode(load_robot("tandem"))
    try:
        heard: dict[str, list[str]] = {}

        def hear(topic: str, message: Any) -> None:
            heard[topic] = list(message.name)

        for source in contract["observations"]["observation.state"]:
            topic = source["channel"]["topic"]
            node.bus.subscribe(topic, partial(hear, topic))
        command = joint_state(["gripper_0", "gripper_1"], [1.0, 0.25])
        node.bus.publish(contract["actions"]["action"][1]["channel"]["topic"], command)
        node.simulation.step_until(100_000_000)
    finally:
        node.close()
    for source in contract["observations"]["observation.state"]:
        names = [path.removeprefix("position.") for path in source["select"]]
        assert {*names} <= {*heard[source["channel"]["topic"]]}
    assert contract["actions"]["action"][1]["select"] == ["position.gripper_0", "position.gripper_1"]
    right, left = (gripper.status(node.commander.applied) for gripper in node.grippers)
    assert (right, left) == pytest.approx((1.0, 0.25))


def test_rate_is_that_of_the_caller_and_positive() -> None:
    assert yaml.safe_load(rosetta_contract(load_robot("tandem"), 20))["fps"] == 20
    with pytest.raises(UsageError, match=r"rate: must be at least 1 Hz \(got 0\)"):
        rosetta_contract(load_robot("tandem"), 0)
