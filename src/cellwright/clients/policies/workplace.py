"""Workplaces of policies: what an agent asks of a cell, or of a robot's node."""

from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Protocol, TypeAlias

from cellwright.clients.client.pictures import LatestPicture
from cellwright.clients.client.session import Latest, NodeClient
from cellwright.clients.policies.key_map import Cell
from cellwright.clients.policies.targets import ToolArm

Reader: TypeAlias = tuple[Callable[[], float], Latest]
"""Returns the newest value of a channel; and the message that it is from."""


class Commander(Protocol):
    """Sends the targets of all channels, period by period."""

    def begin(self, values: Sequence[float]) -> None:
        """Begin at the present values of the channels."""

    def send(self, targets: Sequence[float]) -> None:
        """Send the targets of all channels, for the end of the period that begins now."""


class Workplace(Protocol):
    """Workplace of a policy."""

    @property
    def client(self) -> NodeClient:
        """Its client: time and messages."""

    @property
    def names(self) -> Cell:
        """Names that a key map may use."""

    @property
    def arms(self) -> Mapping[str, ToolArm]:
        """Arms whose tools are observed and commanded, by their names."""

    @property
    def sentence(self) -> str:
        """The task in words; may be empty."""

    def start(self) -> None:
        """Let the work begin."""

    def is_over(self) -> bool:
        """Return whether there is nothing more to do."""

    def takes_commands(self) -> bool:
        """Return whether commands act now; after a time without, targets begin at the measured values."""

    def camera(self, name: str) -> LatestPicture:
        """Return the newest picture of a camera."""

    def readers(self) -> list[Reader]:
        """Return what reads each channel; channels of one message share it."""

    def commander(self, period: int, channels: Collection[str]) -> Commander:
        """Return what sends targets of these channels, for control periods of this length [ns]."""
