"""Streams of frames: changes only, encoded once for all pages, with a panel now and then."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.middleware.wire.frames import Frame, FrameKind
from cellwright.rendering.scene.scene import SceneFrame, decode_frame, is_whole_frame
from cellwright.util.errors import UsageError
from cellwright.viewer.services.frame_stream import PANEL_PERIOD, FrameStream
from cellwright.viewer.services.scene import SceneServices, ServedScene
from tests.support.cells import KITTING, WHOLE


class Follower:
    """Client of a stream."""

    def __init__(self, services: SceneServices, **request: Any) -> None:
        stream = services.frame_or_stream({"ahead": 5, **request})
        assert isinstance(stream, FrameStream)
        self.stream = stream
        self.frame: SceneFrame | None = None
        self.data = b""
        self.payload: bytes | None = None

    def take(self, at: float) -> dict[str, Any] | None:
        """Take the next answer at a wall time [s]; return its JSON, or None without one."""
        self.payload = self.stream.next(at)
        if self.payload is None:
            return None
        answer, data = Frame(FrameKind.DATA, payload=self.payload).data()
        self.data = bytes(data)
        self.frame = decode_frame(data, self.frame)
        return answer


def counted(panels: list[dict[str, Any]]) -> Callable[[dict[str, Any]], dict[str, Any]]:
    """Panel service that notes its requests."""

    def panel(request: dict[str, Any]) -> dict[str, Any]:
        panels.append(request)
        return {"kind": "any", "number": len(panels), "digest": "abc"}

    return panel


def test_stream_begins_with_whole_frame_and_goes_on_with_changes() -> None:
    cell = Cell(WHOLE)
    services = SceneServices(ServedScene(cell))
    follower = Follower(services)
    for number in range(20):
        answer = follower.take(0.05 * number)
        assert answer is not None
        assert answer["tick"] == cell.simulation.clock.tick
        assert is_whole_frame(follower.data) == (number == 0)
        assert follower.frame is not None
        assert follower.frame.equals(decode_frame(services.frame({})[1]))
        cell.step()


def test_stream_sends_nothing_while_time_stands_but_with_each_panel() -> None:
    cell = Cell(KITTING)
    panels: list[dict[str, Any]] = []
    follower = Follower(SceneServices(ServedScene(cell), counted(panels)))
    first = follower.take(0.0)
    assert first is not None
    assert first["panel"]["number"] == 1
    assert follower.take(PANEL_PERIOD / 2) is None
    again = follower.take(PANEL_PERIOD)
    assert again is not None
    assert again["panel"]["number"] == 2
    assert again["sequence"] == first["sequence"]
    cell.step()
    moved = follower.take(PANEL_PERIOD * 1.2)
    assert moved is not None
    assert "panel" not in moved
    assert panels == [{"robot": None}, {"robot": "abc"}], "constants are left out later"


def test_streams_share_frames_and_panels() -> None:
    cell = Cell(WHOLE)
    panels: list[dict[str, Any]] = []
    services = SceneServices(ServedScene(cell), counted(panels))
    one, other = Follower(services), Follower(services)
    for number in range(4):
        for follower in (one, other):
            assert follower.take(0.05 * number)
        assert one.payload is other.payload
        cell.step()
    late = Follower(services)
    assert late.take(0.2)
    assert one.take(0.2)
    assert late.payload is not one.payload
    assert is_whole_frame(late.data)
    assert len(panels) == 1


def test_streams_have_the_overlays_of_their_requests() -> None:
    services = SceneServices(ServedScene(Cell(KITTING)))
    plain, forces = Follower(services), Follower(services, contacts=True)
    assert "contacts" not in (plain.take(1.0) or {})
    assert "contacts" in (forces.take(1.0) or {})


def test_stream_that_missed_frames_gets_all_their_changes() -> None:
    cell = Cell(WHOLE)
    services = SceneServices(ServedScene(cell))
    slow, quick = Follower(services), Follower(services)
    slow.take(0.0)
    for number in range(50):  # more than the service keeps
        quick.take(0.05 * number)
        cell.step()
    slow.take(3.0)
    assert not is_whole_frame(slow.data)
    assert slow.frame is not None
    assert slow.frame.equals(decode_frame(services.frame({})[1]))


@pytest.mark.parametrize("every", [1, 7])
def test_stream_leaves_state_hash_unchanged(every: int) -> None:
    watched, alone = Cell(WHOLE), Cell(WHOLE)
    follower = Follower(SceneServices(ServedScene(watched)), sensors=True, contacts=True)
    for tick in range(200):
        watched.step()
        alone.step()
        if tick % every == 0:
            follower.take(0.01 * tick)
    assert watched.state_hash() == alone.state_hash()


@pytest.mark.parametrize("ahead", [0, -1, 101, True, 1.0, "1", []])
def test_stream_of_invalid_length_is_refused(ahead: object) -> None:
    services = SceneServices(ServedScene(Cell(KITTING)))
    with pytest.raises(UsageError, match=r"cellwright/frame: ahead must be a whole number from 1 to 100 \(got "):
        services.frame_or_stream({"ahead": ahead})
