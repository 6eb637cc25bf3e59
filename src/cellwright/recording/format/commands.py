"""Commands in a recording: external input of a run with its ticks, from which the same run follows again."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any, TypeAlias

from cellwright.engine.clock import Clock
from cellwright.middleware.bus import Bus, ExternalInput, InputKind
from cellwright.middleware.messages import TYPES, TypeSet, type_of
from cellwright.util.errors import CellwrightError, MessageError, RecordingError

Extras: TypeAlias = Mapping[str, Callable[[dict[str, Any]], object]]
"""Handlers of input that bypasses the bus, by name."""


@dataclass(frozen=True, slots=True)
class Command:
    """One external input.

    Attributes:
        tick: number of ticks that had passed.
        kind: kind of input.
        name: of the topic or service.
        type: short name of the message or service type; empty for input that bypasses the bus.
        node: the sender.
        data: the message or request as CDR; JSON for input that bypasses the bus.
        stamp: reading of a second clock when it arrived [ns], such as that of a robot's node; None without one.
    """

    tick: int
    kind: InputKind
    name: str
    type: str
    node: str
    data: bytes
    stamp: int | None = None

    @staticmethod
    def of(
        given: ExternalInput, tick: int, type_name: str, stamp: int | None = None, types: TypeSet = TYPES
    ) -> Command:
        """Make a command of an external input.

        Raises:
            MessageError: a value does not fit its field.
        """
        data = json.dumps(given.message).encode() if given.kind is InputKind.EXTRA else types.to_cdr(given.message)
        return Command(tick, given.kind, given.name, type_name, given.node, data, stamp)

    def message(self, types: TypeSet = TYPES) -> Any:
        """Decode the message or request; a dictionary of JSON values for input that bypasses the bus.

        Raises:
            RecordingError: the type is unknown, or the bytes do not fit it.
        """
        try:
            if self.kind is InputKind.EXTRA:
                request = json.loads(self.data)
                if not isinstance(request, dict):
                    raise MessageError("not a JSON object")
                return request
            is_call = self.kind is InputKind.CALL
            return types.from_cdr(self.data, types.service(self.type).request if is_call else types.message(self.type))
        except (CellwrightError, ValueError, RecursionError) as error:
            raise RecordingError(f"invalid command on {self.name} at tick {self.tick}: {error}") from None

    def carry_out(self, bus: Bus, extras: Extras | None = None) -> None:
        """Execute the command again; one that was refused is refused again.

        Raises:
            RecordingError: it cannot be decoded, or is something that cannot be done here.
        """
        message = self.message(bus.types)
        if self.kind is InputKind.EXTRA:
            extra = (extras or {}).get(self.name)
            if extra is None:
                raise RecordingError(f"{self.name}: the request at tick {self.tick} is not supported here")
            with suppress(CellwrightError):
                extra(message)
            return
        with suppress(CellwrightError):
            (bus.call if self.kind is InputKind.CALL else bus.publish)(
                self.name, message, node=self.node, is_decoded=True
            )

    def encode(self) -> str:
        """Encode as JSON."""
        values = {"tick": self.tick, "kind": self.kind.value, "name": self.name, "type": self.type, "node": self.node}
        return json.dumps({**values, "stamp": self.stamp, "data": base64.b64encode(self.data).decode()})

    @staticmethod
    def decode(text: str) -> Command:
        """Decode a command from untrusted text.

        Raises:
            RecordingError: the text is no command.
        """
        try:
            values = json.loads(text)
            kind, data = InputKind(values["kind"]), base64.b64decode(values["data"], validate=True)
            tick, stamp, name, type_name, node = (values[key] for key in ("tick", "stamp", "name", "type", "node"))
            if (
                not all(isinstance(each, str) for each in (name, type_name, node))
                or type(tick) is not int
                or not 0 <= tick < 1 << 62
                or not (stamp is None or type(stamp) is int)
            ):
                raise ValueError("values of wrong types")
            return Command(tick, kind, name, type_name, node, data, stamp)
        except (ValueError, TypeError, KeyError, RecursionError):
            raise RecordingError(f"invalid command: {text!r:.60}") from None


def note_commands(
    bus: Bus, clock: Clock, take: Callable[[Command], None], stamp: Callable[[], int] | None = None
) -> Callable[[], None]:
    """Report each external input of a bus before it is handled, until the returned function is called.

    Args:
        bus: the bus.
        clock: counts the ticks.
        take: called with each command.
        stamp: second clock for the time of arrival (see `Command.stamp`).
    """

    def note(given: ExternalInput) -> None:
        match given.kind:
            case InputKind.PUBLISH:
                type_name = type_of(type(given.message))
            case InputKind.CALL:
                type_name = bus.service(given.name).type.name
            case InputKind.EXTRA:
                type_name = ""
        take(Command.of(given, clock.tick, type_name, None if stamp is None else stamp(), bus.types))

    bus.on_input.append(note)
    return partial(bus.on_input.remove, note)
