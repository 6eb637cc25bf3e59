"""Tests of the limits from the ROS master's description of a robot; here the test sets the master's answer."""

import threading
from collections.abc import Iterator
from typing import Any
from xmlrpc.server import SimpleXMLRPCServer

import pytest

from cellwright.cli.operate.connection import described_limits

URDF = """<robot name="one"><link name="a"/><link name="b"/><joint name="elbow" type="revolute"><parent link="a"/>
<child link="b"/><axis xyz="0 0 1"/><limit lower="-1" upper="2" effort="3" velocity="4"/></joint></robot>"""


@pytest.fixture
def master() -> Iterator[dict[str, Any]]:
    """Yield the answer of the master, with its address under `uri`."""
    answer: dict[str, Any] = {}
    with SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False, allow_none=True) as server:
        server.register_function(lambda _caller, _name: answer["parameter"], "getParam")
        thread = threading.Thread(target=server.serve_forever, args=(0.01,))
        thread.start()
        answer["uri"] = f"http://127.0.0.1:{server.server_address[1]}"
        yield answer
        server.shutdown()
        thread.join()


def test_limits_of_description_are_those_of_urdf(master: dict[str, Any]) -> None:
    master["parameter"] = (1, "", URDF)
    limits = described_limits({"ROS_MASTER_URI": master["uri"]})
    assert limits.source == "robot_description"
    assert (limits.of_joint("elbow").lower, limits.of_joint("elbow").upper) == (-1.0, 2.0)


@pytest.mark.parametrize("answer", [(-1, "is not set", 0), (1, "", 5), (1, "", "<robot"), (1, "", ""), "nonsense"])
def test_limits_of_invalid_description_are_unknown(answer: Any, master: dict[str, Any]) -> None:
    master["parameter"] = answer
    assert not described_limits({"ROS_MASTER_URI": master["uri"]}).joints


def test_limits_without_ros_master_are_unknown() -> None:
    assert not described_limits({"ROS_MASTER_URI": "http://127.0.0.1:1"}).joints
    assert not described_limits({"ROS_MASTER_URI": "nonsense"}).joints
