"""Scene and frames as clients receive them: whole, at any time, and without effect on the state."""

import hashlib
import json
import re
from typing import Any

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.wire.frames import MAX_FRAME_BYTES, Frame, FrameKind
from cellwright.rendering.scene.scene import SceneFrame, decode_frame, decode_scene, is_whole_frame
from cellwright.viewer.services import scene as scene_service
from cellwright.viewer.services.control import Control
from cellwright.viewer.services.names import FRAME, SCENE
from cellwright.viewer.services.scene import HISTORY_LENGTH, SceneServices, ServedScene
from tests.middleware.server.talk import served
from tests.support.cells import KITTING, WHOLE


def test_client_receives_scene_and_frames() -> None:
    cell = Cell(KITTING, competition=False)
    with served(cell) as hall:
        scene_service.offer_viewer_services(hall.server, cell, lambda _: {}, Control(RateControl()))
        client = hall.connect()
        answer, data = client.ask(Frame(FrameKind.CALL, 5, SCENE, payload=b"{}")).data()
        assert answer["digest"] == hashlib.sha256(data).hexdigest()
        scene = decode_scene(bytes(data))
        assert scene.name == cell.name
        cell.step()
        found, data = client.ask(Frame(FrameKind.CALL, 6, FRAME, payload=json.dumps({"anything": 1}).encode())).data()
    assert (found["tick"], found["digest"]) == (1, answer["digest"])
    frame = decode_frame(data)
    assert frame.time == cell.simulation.now
    assert len(frame.poses) == len(scene.bodies)
    tray = scene.bodies.index("agv1::kit_tray_1::kit_tray_1::tray")
    body = cell.simulation.data.body("agv1::kit_tray_1::kit_tray_1::tray")
    np.testing.assert_allclose(frame.poses[tray, :3], body.xpos, atol=1e-6)


def test_parts_out_of_play_are_hidden() -> None:
    cell = Cell(WHOLE)
    services = SceneServices(ServedScene(cell))
    scene = decode_scene(services.scene({})[1])
    frame = decode_frame(services.frame({})[1])
    hidden = {scene.bodies[index] for index in np.flatnonzero(~frame.shown)}
    assert hidden == set(cell.parts.names) - cell.parts.in_play != set()


def test_frame_after_reset_has_next_run_number() -> None:
    cell = Cell(KITTING)
    services = SceneServices(ServedScene(cell))
    before = services.frame({})[0]["run"]
    cell.reset()
    assert services.frame({})[0]["run"] == before + 1


@pytest.mark.parametrize("every", [1, 7])
def test_scene_requests_leave_state_hash_unchanged(every: int) -> None:
    watched, alone = Cell(WHOLE), Cell(WHOLE)
    services = SceneServices(ServedScene(watched))
    for tick in range(200):
        watched.step()
        alone.step()
        if tick % every == 0:
            services.frame({})
    assert watched.state_hash() == alone.state_hash()


class FrameClient:
    """Client that polls as a page does: with the number of its newest frame."""

    def __init__(self, services: SceneServices) -> None:
        self.services = services
        self.request: dict[str, Any] = {}
        self.frame: SceneFrame | None = None
        self.data = b""

    def look(self) -> int:
        """Request a frame; return its sequence number."""
        answer, self.data = self.services.frame(self.request)
        self.frame = decode_frame(self.data, self.frame)
        self.request = {"since": answer["sequence"]}
        return int(answer["sequence"])

    def has(self, cell: Cell) -> bool:
        """Return whether its poses are the current ones."""
        whole = decode_frame(self.services.frame({})[1])
        return self.frame is not None and self.frame.equals(whole) and self.frame.time == cell.simulation.now


def test_frame_since_recent_sequence_holds_changes_only() -> None:
    cell = Cell(WHOLE)
    frame_client = FrameClient(SceneServices(ServedScene(cell)))
    frame_client.look()
    whole = len(frame_client.data)
    assert is_whole_frame(frame_client.data)
    for _ in range(50):
        cell.step()
        frame_client.look()
        assert not is_whole_frame(frame_client.data)
        assert len(frame_client.data) < whole
        assert frame_client.has(cell)


def test_frame_of_same_state_keeps_its_sequence_number(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = Cell(KITTING)
    source = ServedScene(cell)
    services = SceneServices(source)
    one, other = FrameClient(services), FrameClient(services)
    assert one.look() == other.look()
    cell.step()
    number = one.look()
    assert number == other.look() == one.look()
    now = source.frame()
    hidden = SceneFrame(now.time, now.poses, ~now.shown)  # a part disappears while time is paused
    monkeypatch.setattr(source, "frame", lambda: hidden)
    assert one.look() == other.look() == number + 1
    assert one.has(cell)


@pytest.mark.parametrize("since", [None, True, "1", -1, 2**40, [], {}])
def test_frame_since_unknown_sequence_is_whole(since: object) -> None:
    services = SceneServices(ServedScene(Cell(KITTING)))
    assert is_whole_frame(services.frame({"since": since})[1])
    assert is_whole_frame(services.frame({"since": since})[1])


def test_frame_since_forgotten_sequence_is_whole_and_next_one_is_not() -> None:
    cell = Cell(KITTING)
    services = SceneServices(ServedScene(cell))
    often, seldom = FrameClient(services), FrameClient(services)
    seldom.look()
    for _ in range(HISTORY_LENGTH):
        cell.step()
        often.look()
    seldom.look()
    assert is_whole_frame(seldom.data)
    cell.step()
    seldom.look()
    assert not is_whole_frame(seldom.data)
    assert seldom.has(cell)


def test_frames_go_on_after_reset() -> None:
    cell = Cell(WHOLE)
    frame_client = FrameClient(SceneServices(ServedScene(cell)))
    for _ in range(20):
        cell.step()
        frame_client.look()
    cell.reset()
    frame_client.look()
    assert frame_client.has(cell)


def test_scene_too_large_for_frame_is_refused_with_its_size() -> None:
    cell = Cell(KITTING, competition=False)
    scene = ServedScene(cell)
    scene.__dict__["scene"] = bytes(MAX_FRAME_BYTES)
    with served(cell) as hall:
        SceneServices(scene).offer(hall.server)
        answer = hall.connect().ask(Frame(FrameKind.CALL, 5, SCENE, payload=b"{}"))
        assert (answer.kind, answer.name) == (FrameKind.REFUSED, "UsageError")
        assert re.match(r"cellwright/scene: a frame of 16777\d+ bytes is too long \(at most 16777216\)", answer.text())
        assert hall.connect("/other").ask(Frame(FrameKind.CALL, 5, FRAME, payload=b"{}")).kind is FrameKind.DATA
