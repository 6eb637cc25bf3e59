"""Common behaviour of devices: plain state, and event handlers by the names of methods."""

from __future__ import annotations

from typing import ClassVar

import pytest

from cellwright.engine.device import Device
from cellwright.util.errors import UsageError


class Lamp(Device):
    STATE: ClassVar[tuple[str, ...]] = ("colour", "_level")

    def __init__(self) -> None:
        super().__init__("lamp")
        self.colour, self._level, self.bulbs = "red", 3, 1

    def handle_dim(self, level: int, colour: str) -> None:
        self._level, self.colour = level, colour


def test_plain_state_saves_and_restores_named_attributes() -> None:
    lamp, other = Lamp(), Lamp()
    lamp.colour, lamp._level, lamp.bulbs = "green", 5, 7
    assert lamp.get_state() == {"colour": "green", "level": 5}
    other.set_state(lamp.get_state())
    assert (other.colour, other._level, other.bulbs) == ("green", 5, 1)
    assert Device("bare").get_state() == {}


def test_event_calls_handler_of_its_name_or_is_refused() -> None:
    lamp = Lamp()
    lamp.handle("dim", (1, "blue"))
    assert (lamp.colour, lamp._level) == ("blue", 1)
    with pytest.raises(UsageError, match=r"device 'lamp' does not know the event 'burst'\(2,\)"):
        lamp.handle("burst", (2,))
