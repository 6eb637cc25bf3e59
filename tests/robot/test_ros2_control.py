"""Description for ros2_control: xacro expands it, and it has the robot's joints."""

from dataclasses import replace
from xml.etree.ElementTree import fromstring

import pytest
import xacro

import cellwright
from cellwright.config.robot.robots import bundled
from cellwright.robot.interface import IO_TELEOP
from cellwright.robot.ros2_control import COMMANDS, PLUGIN, STATES, ros2_control_xacro


@pytest.mark.parametrize("name", bundled())
def test_macro_expands_to_all_joints_of_robot(name: str) -> None:
    config = replace(cellwright.load_robot(name), name="My robot")
    call = '<xacro:ros2_control commands="/mine"/>\n</robot>'
    document = xacro.parse(ros2_control_xacro(config).replace("</robot>", call))
    xacro.process_doc(document)
    system = fromstring(document.toxml()).find("ros2_control")
    assert system is not None
    assert (system.get("name"), system.get("type")) == ("My_robot", "system")
    assert system.findtext("hardware/plugin") == PLUGIN
    assert [each.text for each in system.findall("hardware/param")] == ["/mine", STATES]
    joints = {str(each.get("name")): each for each in system.findall("joint")}
    assert list(joints) == [joint.name for joint in config.robot.driven]
    for joint in config.robot.driven:
        described = joints[joint.name]
        assert (described.find("command_interface") is not None) == (joint.mimic is None)
        assert [each.get("name") for each in described.findall("state_interface")] == ["position", "velocity"]
        assert float(described.findtext("state_interface/param") or "nan") == config.home.get(joint.name, 0.0)


def test_topics_are_those_of_the_node() -> None:
    assert {COMMANDS, STATES} <= {row.name for row in IO_TELEOP}
