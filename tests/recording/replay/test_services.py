from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from cellwright.engine.rate_control import RateControl
from cellwright.middleware.server import Server
from cellwright.recording.format.format import FRAME
from cellwright.recording.replay.playback import Playing, Recorded
from cellwright.recording.replay.services import RecordingServices
from cellwright.rendering.scene import Scene, SceneShape, ShapeLayer, ShapeType
from cellwright.rendering.scene.scene import decode_scene, encode_scene
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from cellwright.util.pose import Pose
from cellwright.viewer.services.scene import SceneServices
from tests.recording.replay.memory import BODIES, SECOND, Memory, frame_at, recording

BALL = SceneShape(1, ShapeType.SPHERE, (0.1, 0.0, 0.0), Pose(), (1.0, 0.0, 0.0, 1.0), ShapeLayer.BOTH)


@pytest.fixture
def memory() -> Memory:
    found = recording(2)
    found.encoded_scene = encode_scene(Scene("lesson", ("world", "ball", "part"), (BALL,), ()))
    return found


@pytest.fixture
def server(memory: Memory) -> Iterator[Server]:
    server = Server(Recorded(memory), port=0)
    yield server
    server.close("the test is over")


def services(memory: Memory, server: Server, **more: Any) -> RecordingServices:
    return RecordingServices(Playing(Recorded(memory), RateControl(), **more))


def test_scene_and_frame_services_give_recorded_data(memory: Memory, server: Server) -> None:
    offered = services(memory, server, first=SECOND)

    answers = SceneServices(offered)
    (scene, scene_data), (frame, frame_data) = answers.scene({}), answers.frame({})

    assert decode_scene(scene_data).bodies == ("world", "ball", "part")
    assert scene["about"] == {}
    assert frame["digest"] == scene["digest"]
    assert frame["tick"] == 500
    assert frame_data == frame_at(SECOND).encode()


def test_panel_is_newest_at_time(memory: Memory, server: Server) -> None:
    offered = services(memory, server, first=SECOND, last=3 * SECOND // 2).panel({})

    assert offered == {"kind": "recording", "name": "lesson", "time": 1.0, "begin": 1.0, "end": 1.5, "of": {"half": 2}}


def test_seek_starts_new_run_number(memory: Memory, server: Server) -> None:
    offered = services(memory, server)
    before = offered.details({})["run"]

    offered.control.control({"action": "seek", "time": 1.48})

    assert offered.details({})["run"] != before
    assert offered.frame().time == 1_480_000_000
    assert offered.panel({})["of"] == {"half": 2}


@pytest.mark.parametrize(("requested", "time"), [(-5, 0.5), (99.0, 1.5), (1, 1.0)])
def test_seek_is_clamped_to_played_range(memory: Memory, server: Server, requested: float, time: float) -> None:
    offered = services(memory, server, first=SECOND // 2, last=3 * SECOND // 2)

    offered.control.control({"action": "seek", "time": requested})

    assert offered.panel({})["time"] == time


@pytest.mark.parametrize("time", [None, "1", True, float("nan"), float("inf"), [1]])
def test_seek_to_invalid_time_is_refused(memory: Memory, server: Server, time: object) -> None:
    with pytest.raises(RejectedCommandError, match="a number of seconds"):
        services(memory, server).control.control({"action": "seek", "time": time})


def test_reset_and_resume_at_end_go_to_start(memory: Memory, server: Server) -> None:
    offered = services(memory, server, first=SECOND // 2)
    for action in ("reset", "resume"):
        offered.control.control({"action": "seek", "time": 2.0})
        offered.control.control({"action": action})
        assert offered.panel({})["time"] == 0.5


def test_pause_resume_and_speed_work_as_in_cell(memory: Memory, server: Server) -> None:
    control = services(memory, server).control

    assert control.control({"action": "pause"})["paused"]
    assert not control.control({"action": "resume"})["paused"]
    assert control.control({"action": "speed", "factor": 4})["speed"] == 4.0
    with pytest.raises(UnknownNameError, match="seek"):
        control.control({"action": "sek"})


def test_frame_without_recording_hides_bodies(memory: Memory, server: Server) -> None:
    memory.list = [each for each in memory.list if each.topic != FRAME]

    frame = services(memory, server).frame()

    assert len(frame.poses) == BODIES
    assert frame.shown.tolist() == [True, False, False]


@pytest.mark.parametrize("scene", [None, b"", b"nonsense"])
def test_recording_without_scene_gives_empty_world(memory: Memory, server: Server, scene: bytes | None) -> None:
    memory.encoded_scene = scene
    offered = services(memory, server)

    assert decode_scene(offered.scene).bodies == ("world",)
    assert len(offered.frame().poses) == 1
