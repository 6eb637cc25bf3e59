"""A cell with an operator's reports, and a connection to it that keeps what is sent."""

from __future__ import annotations

from functools import cache
from typing import Any

from cellwright.cell.cell import Cell
from cellwright.clients.agents.operator.tool_arms import OperatedArm
from cellwright.config.trial.trial import Trial
from cellwright.viewer.web.cell_operator.arms import OperatorState, described_arms
from cellwright.viewer.web.cell_operator.sender import Sender
from tests.support.cells import ARM_ONLY, INITIAL


class FakeLink:
    """Connection to a cell of this process.

    Args:
        trial: the cell.
    """

    address = ("", 0)
    welcome: dict[str, Any] = {}  # noqa: RUF012 - as in the protocol

    def __init__(self, trial: Trial = ARM_ONLY) -> None:
        self.cell = Cell(trial)
        self.sent: list[tuple[str, Any]] = []
        self.is_closed = False

    def sibling(self) -> FakeLink:
        return self

    def publish(self, topic: str, message: Any) -> None:
        self.sent.append((topic, message))

    def call(self, service: str, request: Any) -> Any:
        self.sent.append((service, request))
        return self.cell.bus.call(service, request)

    def close(self) -> None:
        self.is_closed = True


class KeepingSender(Sender):
    """Sender that keeps what it is to send."""

    def __init__(self) -> None:
        self.given: list[tuple[str, Any]] = []

    def command(self, text: str) -> None:
        self.given.append(("command", text))

    def put(self, topic: str, message: Any) -> None:
        self.given.append((topic, message))

    def call(self, service: str, request: Any) -> None:
        self.given.append((service, request))


@cache
def arms() -> dict[str, OperatedArm]:
    """The arm of 2017, as a page knows it."""
    return described_arms(FakeLink())  # type: ignore[arg-type]


def report(**changes: Any) -> dict[str, Any]:
    """Report of the agent, with changes of the arm or of the whole."""
    arm = {"mode": "idle", "why": "", "upright": True, "belt": False, "aim": None, "joints": list(INITIAL)}
    whole: dict[str, Any] = {"arm": "arm", "stopped": False, "begun": True, "note": ""}
    for name, value in changes.items():
        (arm if name in arm else whole)[name] = value
    return {**whole, "arms": {"arm": arm}}


def state(**changes: Any) -> OperatorState:
    """State that the report says."""
    return OperatorState.read(report(**changes))
