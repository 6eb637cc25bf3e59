"""Sender of a browser's requests."""

from __future__ import annotations

import threading
from typing import Any

import pytest

from cellwright.clients.agents.operator.requests import COMMAND, JOINTS, POSE, joints_request, pose_request
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.util.errors import CellwrightError
from cellwright.util.pose import Pose
from cellwright.viewer.web.cell_operator.sender import Sender
from tests.support.cells import KITTING, start
from tests.support.waiting import wait_until
from tests.viewer.web.cell_operator.fakes import FakeLink


class HeldLink(FakeLink):
    """Connection that waits with each message until a test lets it go."""

    def __init__(self) -> None:
        super().__init__()
        self.may_send, self.has_message = threading.Event(), threading.Event()

    def publish(self, topic: str, message: Any) -> None:
        self.has_message.set()
        self.may_send.wait()
        super().publish(topic, message)


def test_newest_pose_is_sent_and_commands_go_first() -> None:
    link, said = HeldLink(), list[str]()
    sender = Sender(link, said.append)  # type: ignore[arg-type]
    sender.command("arm arm")
    link.has_message.wait()  # from here on all wait
    for height in (1.0, 2.0, 3.0):
        sender.put(POSE, pose_request(Pose((0.0, 0.0, height))))
    sender.put(JOINTS, joints_request({"a": 1.0}))
    sender.command("home")
    link.may_send.set()
    wait_until(lambda: len(link.sent) == 4, "all messages", seen=lambda: link.sent)
    assert [topic for topic, _ in link.sent] == [COMMAND, COMMAND, POSE, JOINTS]
    assert link.sent[2][1].pose.position.z == 3.0
    sender.close()
    assert link.is_closed
    assert said == []


def test_stop_discards_what_waits() -> None:
    link = HeldLink()
    sender = Sender(link, lambda _text: None)  # type: ignore[arg-type]
    sender.command("arm arm")
    link.has_message.wait()
    sender.put(POSE, pose_request(Pose()))
    sender.command("home")
    sender.command("stop")
    link.may_send.set()
    wait_until(lambda: len(link.sent) == 2, "both", seen=lambda: link.sent)
    sender.close()
    assert [message.data for _, message in link.sent] == ["arm arm", "stop"]


def test_refusals_are_reported() -> None:
    link, said = FakeLink(KITTING), list[str]()

    def refuse(topic: str, message: Any) -> None:
        raise CellwrightError("no operator")

    link.publish = refuse  # type: ignore[method-assign]
    start(link.cell)
    sender = Sender(link, said.append)  # type: ignore[arg-type]
    sender.command("home")
    sender.call("/ariac/agv1", AGVControlRequest(kit_type="order_0_kit_0"))
    sender.call("/ariac/agv1", AGVControlRequest(kit_type="order_0_kit_0"))
    wait_until(lambda: len(said) == 2, "both refusals", seen=lambda: said)
    sender.close()
    assert said == ["no operator", "/ariac/agv1: refused; no reason given"]


def test_closed_sender_sends_nothing_more() -> None:
    link = FakeLink()
    sender = Sender(link, pytest.fail)  # type: ignore[arg-type]
    sender.close()
    sender.command("home")
    assert link.sent == []
