"""Two cells of one name in a domain, and the parameter that no client may set."""

from __future__ import annotations

from typing import Any

import pytest

from tests.ros2.ground import Ground

pytest_plugins = ["tests.ros2.fixtures"]
pytestmark = pytest.mark.ros2

SAID = "another node /cellwright is in this domain: .*give one a namespace"


@pytest.mark.slow
def test_two_cells_of_one_name_both_say_so_and_one_in_a_namespace_does_not(domain: Ground) -> None:
    apart = domain.serve("lesson", "--ros-args", "-r", "__ns:=/cell2")
    first = domain.serve("lesson")
    second = domain.serve("lesson")
    for cell in (first, second):
        cell.wait_for(SAID)
    assert domain.client(set_time).value() == [False, "use_sim_time is read-only", False]
    assert "another node" not in domain.stop(apart)


def set_time() -> list[Any]:
    """Set use_sim_time of a cell that is alone in its namespace; return the answer, and the value then."""
    from rclpy.parameter import Parameter
    from rclpy_node import Node

    with Node() as me:
        wanted = [Parameter("use_sim_time", value=True).to_parameter_msg()]
        node, package = "/cell2/cellwright", "rcl_interfaces"
        (answer,) = me.call(f"{node}/set_parameters", f"{package}/SetParameters", parameters=wanted).results
        (value,) = me.call(f"{node}/get_parameters", f"{package}/GetParameters", names=["use_sim_time"]).values
        return [answer.successful, answer.reason, value.bool_value]
