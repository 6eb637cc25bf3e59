"""Messages of browsers: those of the page's own client pass, all others are dropped before viser."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.util.errors import UsageError
from cellwright.viewer.web.access import MAX_NUMBER, MAX_RATE, MAX_TEXT, Incoming
from tests.viewer.web.fake_viewer import CAMERA

ELEMENTS: dict[str, Any] = {
    "box": SimpleNamespace(value=True, visible=True, disabled=False),
    "slider": SimpleNamespace(value=0.5, visible=True, disabled=False),
    "group": SimpleNamespace(value="Pause", visible=True, options=("Pause", "Resume")),
    "hidden": SimpleNamespace(value=True, visible=False, disabled=False),
    "disabled": SimpleNamespace(value=True, visible=True, disabled=True),
}
HANDLE = {"name": "/scene/operator/0/handle", "owner": ""}
DRAG = {"type": "TransformControlsUpdateMessage", **HANDLE, "wxyz": [1, 0, 0, 0], "position": [0.1, 0, 2]}


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


def incoming(clock: Clock | None = None) -> Incoming:
    found = Incoming(clock or Clock())
    found.follow(SimpleNamespace(_gui_input_handle_from_uuid=ELEMENTS))
    return found


def update(uuid: Any, value: Any, **more: Any) -> dict[str, Any]:
    return {"type": "GuiUpdateMessage", "uuid": uuid, "updates": {"value": value, **more}}


def is_taken(message: Any, found: Incoming | None = None) -> bool:
    found = found or incoming()
    before = found.dropped
    data = message if isinstance(message, bytes | str) else msgspec.msgpack.encode(message)
    taken = found.delay(data) is not None
    assert found.dropped == before + (not taken)
    return taken


@pytest.mark.parametrize(
    "message",
    [
        CAMERA,
        update("box", False),
        update("slider", 0.25),
        update("slider", 3),
        update("group", "Resume"),
        {"type": "GuiButtonHoldMessage", "uuid": "box", "frequency": 10},
        {"type": "TransformControlsDragStartMessage", **HANDLE},
        DRAG,
        {"type": "TransformControlsDragEndMessage", **HANDLE},
    ],
)
def test_messages_of_browser_client_are_accepted(message: dict[str, Any]) -> None:
    assert is_taken(message)


@pytest.mark.parametrize(
    "message",
    [
        update("box", True, removed=True),
        {"type": "GuiUpdateMessage", "uuid": "box", "updates": {"removed": True}},
        {"type": "GuiUpdateMessage", "uuid": "box", "updates": {"update_cb": 7}},
        {"type": "GuiUpdateMessage", "uuid": "box", "updates": {}},
        update("nobody", True),
        update(7, True),
        update("x" * (MAX_TEXT + 1), True),
        update("hidden", True),
        update("disabled", True),
        {"type": "GuiButtonHoldMessage", "uuid": "disabled", "frequency": 10},
        *(update("box", value) for value in (1, 0.0, "yes", None, [True])),
        *(update("slider", value) for value in (True, "0.5", "nan", None, [1], math.nan, math.inf, 2 * MAX_NUMBER)),
        *(update("group", value) for value in ("Stop", True, 1.0, None, ["Pause"], "")),
        {**CAMERA, "fov": math.nan},
        {**CAMERA, "position": [0, 0]},
        {**CAMERA, "wxyz": [0, 0, 0, 0]},
        {**CAMERA, "client_id": 3},
        {**DRAG, "position": [0, math.inf, 0]},
        {**DRAG, "wxyz": [0, 0, 0, 0]},
        {**DRAG, "name": ["/scene"]},
        {"type": "GuiFormDirtyMessage", "uuid": "kept for all who come"},
        {"type": "GuiFormSubmitMessage", "uuid": "box"},
        {"type": "FileTransferStartUpload", "source_component_uuid": "slider", "transfer_uuid": "a", "part_count": 9},
        {"type": "ShareUrlRequest"},
        {"type": "CommandTriggerMessage", "uuid": "box"},
        {"type": ["GuiUpdateMessage"]},
        {"no": "type"},
        [],
        None,
        "a text frame",
        b"",
        b"\xc1",
        b"\x91" * 100_000,
        msgspec.msgpack.encode(CAMERA)[:-3],
        msgspec.msgpack.encode(CAMERA) + b"\xc0",
    ],
)
def test_other_messages_are_dropped_and_counted(message: Any) -> None:
    assert not is_taken(message)


@given(st.binary(max_size=60))
def test_random_bytes_are_dropped(data: bytes) -> None:
    assert not is_taken(data)


def test_element_messages_before_panel_are_dropped() -> None:
    assert not is_taken(update("box", True), Incoming())
    assert is_taken(CAMERA, Incoming())


def test_unsupported_viser_is_refused_by_filter() -> None:
    with pytest.raises(UsageError, match="is not supported"):
        Incoming().follow(SimpleNamespace())


def test_flooding_clicks_wait_and_camera_messages_do_not() -> None:
    clock = Clock()
    found = incoming(clock)
    click, camera = msgspec.msgpack.encode(update("box", True)), msgspec.msgpack.encode(CAMERA)
    waits = [found.delay(click) for _ in range(100)]
    assert waits == pytest.approx([number / MAX_RATE for number in range(100)])
    assert found.delay(camera) == 0.0
    clock.now += 10.0
    assert found.delay(click) == 0.0, "nothing is held against it later"
