"""Filter for the messages of browsers: what viser's own client sends to this page gets to viser, and nothing else.

viser trusts a browser. A message may set any attribute of an element for everybody, `removed` too. It may fill the
memory with files that no element asks for, and viser keeps messages on forms that are not there for all who come later.
So a message is taken here only if it has one of the types below, fields of their types, finite numbers and short texts.
Its element must be there, in use, and able to hold the value. Other messages are dropped and counted; their browser
stays.

Messages that act come in at a limited rate, one message of each browser in turn. A browser that floods the page waits,
and delays no other for long.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Annotated, Any, TypeAlias

import msgspec

from cellwright.util.errors import UsageError

MAX_NUMBER = 1e9
"""Larger numbers are no joint, no place and no time."""
MAX_TEXT = 1000
"""Characters."""
MAX_RATE = 200.0
"""Messages a second that act, of all browsers together."""

_Number: TypeAlias = Annotated[float, msgspec.Meta(ge=-MAX_NUMBER, le=MAX_NUMBER)]
_Text: TypeAlias = Annotated[str, msgspec.Meta(max_length=MAX_TEXT)]
_Three: TypeAlias = tuple[_Number, _Number, _Number]
_Four: TypeAlias = tuple[_Number, _Number, _Number, _Number]


class _Message(msgspec.Struct, tag_field="type", forbid_unknown_fields=True):
    """A message of viser's, under its name there."""


class _Camera(_Message, tag="ViewerCameraMessage"):
    """Where a browser looks from."""

    wxyz: _Four
    position: _Three
    fov: _Number
    near: _Number
    far: _Number
    image_height: _Number
    image_width: _Number
    look_at: _Three
    up_direction: _Three


class _Value(msgspec.Struct, forbid_unknown_fields=True):
    """The only attribute of an element that a browser may set."""

    value: bool | _Number | _Text


class _Update(_Message, tag="GuiUpdateMessage"):
    """An element was used."""

    uuid: _Text
    updates: _Value


class _Hold(_Message, tag="GuiButtonHoldMessage"):
    """A button is held."""

    uuid: _Text
    frequency: _Number


class _Start(_Message, tag="TransformControlsDragStartMessage"):
    """A handle in the scene was taken hold of."""

    name: _Text
    owner: _Text = ""


class _Drag(_Message, tag="TransformControlsUpdateMessage"):
    """It was moved."""

    name: _Text
    wxyz: _Four
    position: _Three
    owner: _Text = ""


class _End(_Message, tag="TransformControlsDragEndMessage"):
    """It was let go."""

    name: _Text
    owner: _Text = ""


_Taken: TypeAlias = _Camera | _Update | _Hold | _Start | _Drag | _End


class Incoming:
    """Decides on messages.

    Args:
        clock: the wall clock [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self.dropped = 0
        """Count of the messages that were not taken."""
        self._clock = clock
        self._next = 0.0
        self._elements: Mapping[str, Any] = {}
        self._decoder = msgspec.msgpack.Decoder(_Taken)

    def follow(self, gui: Any) -> None:
        """Take messages for the elements of viser's GUI, whatever they are at the time; before, there are none.

        Raises:
            UsageError: this version of viser keeps them elsewhere.
        """
        elements = getattr(gui, "_gui_input_handle_from_uuid", None)
        if not isinstance(elements, dict):
            raise UsageError("the page cannot be guarded with this version of viser")
        self._elements = elements

    def delay(self, data: bytes | str) -> float | None:
        """How long a message waits before viser gets it [s]; None to drop it."""
        try:
            message = self._decoder.decode(data) if isinstance(data, bytes) else None
        except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError):
            message = None
        if message is None or not self._fits(message):
            self.dropped += 1
            return None
        if isinstance(message, _Camera):
            return 0.0  # it moves nobody but its browser
        now = self._clock()
        self._next = max(self._next + 1 / MAX_RATE, now)
        return self._next - now

    def _fits(self, message: _Taken) -> bool:
        if isinstance(message, _Update | _Hold):
            element = self._elements.get(message.uuid)
            if element is None or not element.visible or getattr(element, "disabled", False):
                return False
            return isinstance(message, _Hold) or _holds(element, message.updates.value)
        if isinstance(message, _Drag | _Camera):
            return any(message.wxyz)  # a rotation has a direction
        return True


def _holds(element: Any, value: object) -> bool:
    """Whether an element can have a value: of the type that it has now, and one of its options if it has such."""
    options = getattr(element, "options", None)
    if options is not None:
        return value in options
    kind = type(element.value)
    return isinstance(value, bool) if kind is bool else kind in (int, float) and type(value) is float
