"""Publishing to the cell, and calling services."""

from typing import Any

import numpy as np
import pytest

from cellwright.middleware.bus import Bus
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import duration, header
from cellwright.middleware.messages.osrf_gear import (
    AGVControlRequest,
    AGVControlResponse,
    Order,
    SubmitTrayRequest,
    SubmitTrayResponse,
)
from cellwright.middleware.messages.standard import JointTrajectory, JointTrajectoryPoint, String
from cellwright.middleware.messages.std_srvs import TriggerRequest, TriggerResponse
from cellwright.util.errors import MessageError, RejectedCommandError, ServiceFailedError, UnknownNameError, UsageError

COMMAND = "/ariac/arm/command"


class Cell:
    """A cell that receives one topic and serves two services."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.bus = Bus(lambda: 0, self.lines.append)
        self.heard: list[tuple[Any, str]] = []
        self.bus.listen(COMMAND, "trajectory_msgs/JointTrajectory", self.command, node="/cell")
        self.bus.serve("/ariac/agv1", "osrf_gear/AGVControl", self.agv, node="/cell")
        self.bus.serve("/ariac/submit_tray", "osrf_gear/SubmitTray", self.submit)

    def command(self, message: JointTrajectory, node: str) -> None:
        if not message.joint_names:
            raise RejectedCommandError("no joints")
        self.heard.append((message, node))

    def agv(self, request: AGVControlRequest, node: str) -> AGVControlResponse:
        if request.kit_type == "refuse":
            raise RejectedCommandError("not this kit")
        self.heard.append((request, node))
        return AGVControlResponse(True)

    def submit(self, _request: SubmitTrayRequest, _node: str) -> SubmitTrayResponse:
        raise ServiceFailedError("only in state 'go'")


@pytest.fixture
def cell() -> Cell:
    return Cell()


def trajectory(positions: Any = (0.5,), names: Any = ("elbow_joint",)) -> JointTrajectory:
    none = np.array([])
    return JointTrajectory(header(), list(names), [JointTrajectoryPoint(positions, none, none, none, duration(1))])


def test_command_reaches_cell_and_then_subscribers(cell: Cell) -> None:
    listened: list[Any] = []
    cell.bus.subscribe(COMMAND, lambda message: listened.append((message, len(cell.heard))))
    message = trajectory(np.array([0.5]))
    cell.bus.publish(COMMAND, message, node="/agent")
    assert cell.heard == [(message, "/agent")]
    assert listened == [(message, 1)]
    assert cell.bus.refusals.total == 0


def test_command_with_list_of_numbers_is_converted_to_array(cell: Cell) -> None:
    cell.bus.publish(COMMAND, trajectory([0, 1]))
    positions = cell.heard[0][0].points[0].positions
    assert positions.dtype == np.float64
    assert positions.tolist() == [0.0, 1.0]


def test_decoded_message_is_not_validated_again(cell: Cell) -> None:
    cell.bus.publish(COMMAND, message := trajectory([0, 1]), is_decoded=True)
    cell.bus.call("/ariac/agv1", request := AGVControlRequest(7), is_decoded=True)  # type: ignore[arg-type]
    assert [heard for heard, _ in cell.heard] == [message, request]
    with pytest.raises(MessageError, match="takes trajectory_msgs/JointTrajectory"):
        cell.bus.publish(COMMAND, String("up"), is_decoded=True)


def test_decoded_message_with_bounds_is_validated(cell: Cell) -> None:
    cell.bus.listen("/shape", "shape_msgs/SolidPrimitive", cell.command)
    shape: Any = TYPES.message("shape_msgs/SolidPrimitive")
    box = shape(1, np.zeros(4), TYPES.message("geometry_msgs/Polygon")([]))  # type: ignore[call-arg]
    with pytest.raises(MessageError, match="may have at most 3 entries, not 4"):
        cell.bus.publish("/shape", box, is_decoded=True)


def test_command_of_other_type_is_refused_without_effect(cell: Cell) -> None:
    listened: list[Any] = []
    cell.bus.subscribe(COMMAND, listened.append)
    with pytest.raises(
        RejectedCommandError, match="command takes trajectory_msgs/JointTrajectory, not std_msgs/String"
    ):
        cell.bus.publish(COMMAND, String("go"), node="/agent")
    with pytest.raises(MessageError, match=r"points\[0\].positions\[1\] must be a number, not 'x'"):
        cell.bus.publish(COMMAND, trajectory([0.0, "x"]), node="/agent")
    assert (cell.heard, listened) == ([], [])
    assert cell.bus.refusals.counts == {"/ariac/arm/command from /agent": 2}
    assert len(cell.lines) == 2  # two kinds of errors
    assert cell.lines[0].startswith("refused /ariac/arm/command from /agent: /ariac/arm/command takes trajectory_msgs")


def test_command_refused_by_cell_still_reaches_subscribers(cell: Cell) -> None:
    listened: list[Any] = []
    cell.bus.subscribe(COMMAND, listened.append)
    with pytest.raises(RejectedCommandError, match="no joints"):
        cell.bus.publish(COMMAND, trajectory(names=()))
    assert len(listened) == 1
    assert cell.bus.refusals.counts == {COMMAND: 1}
    assert cell.lines == ["refused /ariac/arm/command: no joints"]


def test_publish_without_handler_is_refused(cell: Cell) -> None:
    cell.bus.advertise("/ariac/orders", "osrf_gear/Order")
    for topic in ("/ariac/arm/comand", "/ariac/orders"):
        with pytest.raises(UnknownNameError, match=r"unknown topic to publish on .*known: /ariac/arm/command\)"):
            cell.bus.publish(topic, Order())
    with pytest.raises(UnknownNameError, match="did you mean /ariac/arm/command"):
        cell.bus.publish("/ariac/arm/comand", trajectory())
    assert cell.bus.refusals.total == 3


def test_call_returns_response_of_service(cell: Cell) -> None:
    response = cell.bus.call("/ariac/agv1", AGVControlRequest("order_0_kit_0"), node="/agent")
    assert response == AGVControlResponse(True)
    assert cell.heard == [(AGVControlRequest("order_0_kit_0"), "/agent")]


def test_call_with_invalid_request_is_refused_and_counted(cell: Cell) -> None:
    with pytest.raises(
        RejectedCommandError, match="/ariac/agv1 takes osrf_gear/AGVControl_Request, not std_srvs/Trigger_Request"
    ):
        cell.bus.call("/ariac/agv1", TriggerRequest())
    with pytest.raises(RejectedCommandError, match="kit_type must be a string, not 3"):
        cell.bus.call("/ariac/agv1", AGVControlRequest(3))  # type: ignore[arg-type]
    with pytest.raises(RejectedCommandError, match="not this kit"):
        cell.bus.call("/ariac/agv1", AGVControlRequest("refuse"))
    assert cell.heard == []
    assert cell.bus.refusals.counts == {"/ariac/agv1": 3}


def test_call_of_failing_service_raises_service_failed(cell: Cell) -> None:
    with pytest.raises(ServiceFailedError, match="only in state 'go'"):
        cell.bus.call("/ariac/submit_tray", SubmitTrayRequest())
    assert cell.bus.refusals.total == 0


def test_call_of_unknown_service_names_known_ones(cell: Cell) -> None:
    with pytest.raises(UnknownNameError, match="did you mean /ariac/agv1") as error:
        cell.bus.call("/ariac/agv3", AGVControlRequest())
    assert error.value.valid == ("/ariac/agv1", "/ariac/submit_tray")
    assert cell.bus.refusals.total == 1
    with pytest.raises(UnknownNameError):
        cell.bus.service("/ariac/agv3")


def test_service_with_taken_name_or_wrong_response_type_is_refused(cell: Cell) -> None:
    with pytest.raises(UsageError, match="service /ariac/agv1 already exists"):
        cell.bus.serve("/ariac/agv1", "osrf_gear/AGVControl", cell.agv)
    with pytest.raises(UnknownNameError, match="unknown service type"):
        cell.bus.serve("/ariac/drone", "osrf_gear/DroneControl", cell.agv)
    cell.bus.serve("/wrong", "std_srvs/Trigger", lambda _request, _node: AGVControlResponse())
    with pytest.raises(UsageError, match="/wrong must answer with std_srvs/Trigger_Response"):
        cell.bus.call("/wrong", TriggerRequest())
    cell.bus.serve("/right", "std_srvs/srv/Trigger", lambda _request, _node: TriggerResponse(True, "done"))
    assert cell.bus.call("/right", TriggerRequest()).message == "done"


def test_services_list_type_and_node(cell: Cell) -> None:
    agv, submit = cell.bus.services()
    assert (agv.name, agv.type.name, agv.node) == ("/ariac/agv1", "osrf_gear/AGVControl", "/cell")
    assert (submit.name, submit.type.name, submit.node) == ("/ariac/submit_tray", "osrf_gear/SubmitTray", "")
    assert cell.bus.service("/ariac/agv1") == agv
