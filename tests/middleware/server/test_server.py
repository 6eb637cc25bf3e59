"""Protocol of the server: frames of a client, and the answers."""

from __future__ import annotations

import socket

import pytest

from cellwright.cell.cell import Cell
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.osrf_gear import AGVControlRequest, AGVControlResponse, Order, SubmitTrayRequest
from cellwright.middleware.messages.standard import JointState
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.middleware.server import Server
from cellwright.middleware.wire.frames import Frame, FrameKind, advance
from cellwright.util.errors import UsageError
from tests.middleware.server.talk import served
from tests.support.cells import ARM_ONLY, INITIAL, KITTING, WHOLE, start, way
from tests.support.waiting import wait_until


def test_welcome_lists_all_topics_and_services_with_types() -> None:
    cell = Cell(WHOLE, competition=False)
    with served(cell) as hall:
        welcome = hall.connect(encoding="ros1").welcome
        assert (welcome["protocol"], welcome["trial"], welcome["timestep"]) == (1, "whole", [1, 500])
        assert (welcome["lockstep"], welcome["competition"], welcome["time"]) == (False, False, 0)
        topics = {each["name"]: each for each in welcome["topics"]}
        assert list(topics) == [info.name for info in cell.bus.topics()]
        orders = topics["/ariac/orders"]
        assert orders["md5"] == TYPES.md5("osrf_gear/Order")
        assert orders["definition"] == TYPES.definition("osrf_gear/Order")
        assert (orders["direction"], orders["latch"], orders["on_event"]) == ("out", True, True)
        assert topics["/ariac/joint_states"]["rate"] == "50 Hz"
        assert topics["/ariac/joint_states"]["on_event"] is False
        assert topics["/tf"]["publishers"] == ["/robot_state_publisher", "/gazebo"]
        assert topics["/ariac/arm/command"]["direction"] == "in"
        services = {each["name"]: each for each in welcome["services"]}
        assert services["/ariac/agv1"]["type"] == "osrf_gear/AGVControl"
        assert services["/ariac/agv1"]["md5"] == TYPES.md5("osrf_gear/AGVControl")


@pytest.mark.parametrize("encoding", ["cdr", "ros1"])
def test_messages_have_requested_encoding(encoding: str) -> None:
    cell = Cell(ARM_ONLY)
    read = TYPES.from_ros1 if encoding == "ros1" else TYPES.from_cdr
    with served(cell) as hall:
        client = hall.connect(encoding=encoding)
        assert client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/ariac/joint_states")).kind is FrameKind.DONE
        for _ in range(20):
            cell.step()
        client.wait_until(lambda: len(client.messages(5)) == 2)
        messages = [read(data, JointState) for data in client.messages(5)]
        assert [message.header.stamp.nanosec for message in messages] == [20_000_000, 40_000_000]
        assert messages[0].name[1] == "linear_arm_actuator_joint"
        client.say(Frame(FrameKind.UNSUBSCRIBE, 5))
        client.ask(Frame(FrameKind.SUBSCRIBE, 6, "/ariac/trays"))
        assert cell.bus.topic("/ariac/joint_states").subscribers == ()


def test_subscription_to_latched_topic_gets_newest_message_once() -> None:
    cell = Cell(KITTING)
    start(cell)
    cell.step()
    with served(cell) as hall:
        client = hall.connect()
        client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/ariac/orders"))
        (data,) = client.messages(5)
        assert TYPES.from_cdr(data, Order).order_id == "order_0"


def test_subscription_to_one_publisher_gets_its_messages_only() -> None:
    cell = Cell(WHOLE)
    with served(cell) as hall:
        client = hall.connect()
        client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/tf", node="/gazebo"))
        client.ask(Frame(FrameKind.SUBSCRIBE, 6, "/tf"))
        for _ in range(50):
            cell.step()
        assert 0 < len(client.messages(5)) < len(client.messages(6))


def test_call_is_carried_out_while_time_stands() -> None:
    cell = Cell(KITTING)
    with served(cell) as hall:
        client = hall.connect()
        answer = client.call("/ariac/agv1", AGVControlRequest(""), "osrf_gear/AGVControl")
        assert TYPES.from_cdr(answer.payload, AGVControlResponse).success
        assert cell.agvs[1].state == "preparing_to_deliver"
        assert cell.simulation.now == 0


def test_wait_tells_whether_there_was_anything_to_do() -> None:
    with served(Cell(ARM_ONLY)) as hall:
        client = hall.connect()
        wait_until(lambda: not hall.server.wait(0.002), "wait with nothing to do")
        client.say(Frame(FrameKind.SUBSCRIBE, 7, "/ariac/joint_states"))
        assert hall.server.wait(0.002)
        client.wait_for(FrameKind.DONE, 7)
        wait_until(lambda: not hall.server.wait(0.002), "wait with nothing to do")


def test_publish_is_answered_and_takes_effect() -> None:
    cell = Cell(ARM_ONLY)
    with served(cell) as hall:
        client = hall.connect()
        assert cell.arm is not None
        assert cell.arm.controller.end == 0
        assert client.publish("/ariac/arm/command", way(INITIAL)).kind is FrameKind.DONE
        assert cell.arm.controller.end == 1_000_000_000


def test_refusals_name_error_class_and_are_counted_by_node() -> None:
    cell = Cell(ARM_ONLY)
    with served(cell) as hall:
        client = hall.connect()
        trajectory = way(INITIAL, names=("elbow_joint", *["none"] * 6))
        cases = [
            (client.publish("/ariac/arm/command", trajectory), "RejectedCommandError"),
            (client.publish("/ariac/arm/command", TriggerRequest()), "MessageError"),
            (client.publish("/ariac/command", trajectory, node="/other"), "UnknownNameError"),
            (client.publish("/ariac/joint_states", trajectory), "UnknownNameError"),
            (client.call("/ariac/agv1", TriggerRequest()), "UnknownNameError"),
            (client.call("/ariac/submit_tray", TriggerRequest()), "MessageError"),
            (client.ask(Frame(FrameKind.PUBLISH, 9, "/ariac/arm/command", payload=b"rubbish")), "MessageError"),
            (client.ask(advance(8, 10, each_tick=False)), "UsageError"),
            (client.ask(Frame(FrameKind.SUBSCRIBE, 7, "no name")), "UsageError"),
        ]
        assert [answer.name for answer, _ in cases] == [name for _, name in cases]
        assert all(answer.kind is FrameKind.REFUSED and answer.text() for answer, _ in cases)
        counts = cell.bus.refusals.counts
        assert counts["/ariac/arm/command from /me"] == 3
        assert counts["/ariac/command from /other"] == 1


def test_call_of_failing_service_is_refused_with_service_failed() -> None:
    cell = Cell(KITTING, competition=False)
    with served(cell) as hall:
        request = SubmitTrayRequest(tray_id="agv1::kit_tray_1", kit_type="a")
        answer = hall.connect().call("/ariac/submit_tray", request)
        assert (answer.kind, answer.name) == (FrameKind.REFUSED, "ServiceFailedError")


def test_subscription_with_number_in_use_is_refused() -> None:
    with served(Cell(KITTING)) as hall:
        client = hall.connect()
        assert client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/clock")).kind is FrameKind.DONE
        assert client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/clock")).name == "UsageError"


def test_subscription_to_absent_topic_is_accepted() -> None:
    cell = Cell(KITTING)
    with served(cell) as hall:
        client = hall.connect()
        assert client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/ariac/nothing")).kind is FrameKind.DONE
        client.say(Frame(FrameKind.UNSUBSCRIBE, 5), Frame(FrameKind.UNSUBSCRIBE, 77))
        assert client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/clock")).kind is FrameKind.DONE


def test_close_sends_clients_the_reason() -> None:
    with served(Cell(KITTING)) as hall:
        client = hall.connect()
        assert hall.server.clients == ("/me",)
        hall.server.close("enough")
        client.listen()
        assert [(frame.kind, frame.text()) for frame in client.heard] == [(FrameKind.ENDED, "enough")]
        assert client.is_over


def test_disconnected_client_is_unsubscribed() -> None:
    cell = Cell(KITTING)
    with served(cell) as hall:
        client, other = hall.connect(), hall.connect("/other")
        client.ask(Frame(FrameKind.SUBSCRIBE, 5, "/clock"))
        assert cell.bus.topic("/clock").subscribers == ("/me",)
        client.connection.close()
        other.wait_until(lambda: hall.server.clients == ("/other",))
        assert cell.bus.topic("/clock").subscribers == ()


def test_server_on_port_in_use_is_refused() -> None:
    cell = Cell(KITTING)
    with served(cell) as hall, pytest.raises(UsageError, match=f"127.0.0.1:{hall.server.address[1]}: cannot listen"):
        Server(cell, port=hall.server.address[1])


@pytest.mark.parametrize(("host", "port"), [("127.0.0.1", 70_000), ("no.such.host.invalid", 0)])
def test_server_on_invalid_address_is_refused(host: str, port: int) -> None:
    with pytest.raises(UsageError):
        Server(Cell(KITTING), host=host, port=port)


def test_server_listens_on_loopback_by_default() -> None:
    with served(Cell(KITTING)) as hall:
        assert hall.server.is_local
        assert hall.server.address[0] == "127.0.0.1"
        with socket.create_connection(hall.server.address):
            pass


def test_dismiss_ends_agents_and_keeps_viewers() -> None:
    with served(Cell(KITTING)) as hall:
        agent, page = hall.connect("/agent"), hall.connect("/page_1")
        hall.server.dismiss("the run is over", keep=lambda node: node.startswith("/page_"))
        agent.listen()
        page.listen()
        assert [(frame.kind, frame.text()) for frame in agent.heard] == [(FrameKind.ENDED, "the run is over")]
        assert agent.is_over
        assert not page.heard
        assert hall.server.clients == ("/page_1",)
        assert page.ask(Frame(FrameKind.SUBSCRIBE, 5, "/clock")).kind is FrameKind.DONE
