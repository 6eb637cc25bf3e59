"""The ROS parameters of a robot's controller node."""

from __future__ import annotations

import xml.etree.ElementTree as ET
import xmlrpc.client

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.robot.interface import ros_parameters

URDF = '<?xml version="1.0"?><robot name="two arms"><link name="base"/></robot>'


def test_urdf_parameter_is_under_name_of_node() -> None:
    assert ros_parameters(URDF, node="/cell_2/robot", sim_time=False) == {"cell_2/robot": {"robot_description": URDF}}


def test_parameters_without_urdf_are_empty() -> None:
    assert ros_parameters("", node="/robot", sim_time=False) == {}


def test_use_sim_time_is_set_only_with_sim_time() -> None:
    assert ros_parameters("", node="/robot", sim_time=True) == {"use_sim_time": True}


@pytest.mark.parametrize("stray", ["\x1a", "\0", "\x0b", "\uffff", "\ud800"])
def test_characters_forbidden_in_xml_are_removed(stray: str) -> None:
    """A vendor's file has a 0x1A in a comment."""
    found = ros_parameters(URDF.replace("<link", f"{stray}<link"), node="/robot", sim_time=False)
    assert found["robot"]["robot_description"] == URDF


@given(st.text())
def test_urdf_parameter_survives_xmlrpc_round_trip(text: str) -> None:
    (kept,) = ros_parameters(f"x{text}", node="/robot", sim_time=False)["robot"].values()
    request = xmlrpc.client.dumps((kept,), "setParam").encode()
    ((received,), _) = xmlrpc.client.loads(request)
    assert received == ET.fromstring(f"<a>{kept.replace('&', '&amp;').replace('<', '&lt;')}</a>").text
