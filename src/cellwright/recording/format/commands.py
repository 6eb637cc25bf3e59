"""What came from outside in the course of a run, and in which tick: played again it brings about the same run."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

from cellwright.engine.clock import Clock
from cellwright.middleware.bus import Bus, Given, How
from cellwright.middleware.messages import from_cdr, message_type, service_type, to_cdr, type_of
from cellwright.util.errors import CellwrightError, MessageError, RecordingError

Extras: TypeAlias = Mapping[str, Callable[[dict[str, Any]], object]]
"""What is done past the bus, by name."""


@dataclass(frozen=True, slots=True)
class Command:
    """Something that came from outside.

    Attributes:
        tick: how many ticks had passed.
        how: how it came.
        name: of the topic or service.
        type: of the message or service, the short name; empty where it came past the bus.
        node: whom it came from.
        data: the message or request as CDR; JSON where it came past the bus.
        stamp: what a clock of its own told when it came, such as that of a robot's node [ns]; None without one.
    """

    tick: int
    how: How
    name: str
    type: str
    node: str
    data: bytes
    stamp: int | None = None

    @staticmethod
    def of(given: Given, tick: int, type_name: str, stamp: int | None = None) -> Command:
        """What came, as a command.

        Raises:
            MessageError: a value does not fit its field.
        """
        data = json.dumps(given.message).encode() if given.how is How.EXTRA else to_cdr(given.message)
        return Command(tick, given.how, given.name, type_name, given.node, data, stamp)

    def message(self) -> Any:
        """The message or request; a dictionary of JSON values where it came past the bus.

        Raises:
            RecordingError: there is no such type, or the bytes are none of it.
        """
        try:
            if self.how is How.EXTRA:
                asked = json.loads(self.data)
                if not isinstance(asked, dict):
                    raise MessageError("no JSON object")
                return asked
            is_call = self.how is How.CALL
            return from_cdr(self.data, service_type(self.type).request if is_call else message_type(self.type))
        except (CellwrightError, ValueError, RecursionError) as error:
            raise RecordingError(f"the command on {self.name} in tick {self.tick} makes no sense: {error}") from None

    def carry_out(self, bus: Bus, extras: Extras | None = None) -> None:
        """Do it again; what was refused then is refused again.

        Raises:
            RecordingError: it makes no sense, or is something that cannot be done here.
        """
        message = self.message()
        if self.how is How.EXTRA:
            extra = (extras or {}).get(self.name)
            if extra is None:
                raise RecordingError(f"{self.name} was asked for in tick {self.tick}, which cannot be done here")
            with suppress(CellwrightError):
                extra(message)
            return
        with suppress(CellwrightError):
            (bus.call if self.how is How.CALL else bus.publish)(self.name, message, node=self.node, is_decoded=True)

    def encode(self) -> str:
        """As JSON."""
        told = {"tick": self.tick, "kind": self.how.value, "name": self.name, "type": self.type, "node": self.node}
        return json.dumps({**told, "stamp": self.stamp, "data": base64.b64encode(self.data).decode()})

    @staticmethod
    def decode(text: str) -> Command:
        """The command in a text, which may come from anywhere.

        Raises:
            RecordingError: it is none.
        """
        try:
            told = json.loads(text)
            how, data = How(told["kind"]), base64.b64decode(told["data"], validate=True)
            tick, stamp, name, kind, node = (told[key] for key in ("tick", "stamp", "name", "type", "node"))
            if (
                not all(isinstance(each, str) for each in (name, kind, node))
                or type(tick) is not int
                or not 0 <= tick < 1 << 62
                or not (stamp is None or type(stamp) is int)
            ):
                raise ValueError("values of other types")
            return Command(tick, how, name, kind, node, data, stamp)
        except (ValueError, TypeError, KeyError, RecursionError):
            raise RecordingError(f"{text!r:.60} is no command") from None


def note_commands(
    bus: Bus, clock: Clock, take: Callable[[Command], None], stamp: Callable[[], int] | None = None
) -> Callable[[], None]:
    """Take a note of everything that comes to a bus, each before it is handled, until what is returned is called.

    Args:
        bus: the bus.
        clock: counts the ticks.
        take: is given each command.
        stamp: what else tells when it came (see `Command.stamp`).
    """

    def note(given: Given) -> None:
        match given.how:
            case How.PUBLISH:
                type_name = type_of(type(given.message))
            case How.CALL:
                type_name = bus.service(given.name).type.name
            case How.EXTRA:
                type_name = ""
        take(Command.of(given, clock.tick, type_name, None if stamp is None else stamp()))

    bus.on_given.append(note)
    return partial(bus.on_given.remove, note)
