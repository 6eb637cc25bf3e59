"""Tests of `--video` and its options, on the commands in which time passes."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from tests.cli.conftest import CommandLine
from tests.rendering.worker.test_film import read
from tests.support.quick_children import QUICK_DRAWING

pytestmark = QUICK_DRAWING

SMALL = ("--video-size", "64x48")
SHORT = ("--agent", "none", "--until", "0.1", "--no-picture")


@pytest.mark.parametrize("command", ["run lesson", "serve lesson", "teleop tandem"])
@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--video", "a.avi"], "--video a.avi: give a file whose name ends in .mp4"),
        (["--video", "no/a.mp4"], "there is no folder no"),
        (["--video", "a.mp4", "--video-camera", "nowhere"], "--video-camera: unknown view 'nowhere'"),
        (["--video", "a.mp4", "--video-camera", "1,2:3"], "--video-camera 1,2:3: not a camera; give its position"),
        (["--video", "a.mp4", "--video-camera", "1,2,3:1,2,3"], "camera position and target must differ"),
        (["--video", "a.mp4", "--video-speed", "0"], "--video-speed: video speed must be above 0"),
        (["--video", "a.mp4", "--video-size", "64"], "--video-size 64: give width and height"),
        (["--video", "a.mp4", "--video-size", "65x48"], "video width must be an even number from 16 to 4096"),
        (["--video-speed", "2"], "require --video FILE.mp4"),
    ],
)
def test_invalid_video_options_print_one_line(
    command: str, options: list[str], reason: str, cellwright: CommandLine
) -> None:
    ran = cellwright(*command.split(), *options)
    assert (ran.status, ran.out) == (2, "")
    assert reason in ran.err
    assert ran.err.count("\n") == 1


@pytest.mark.parametrize("command", ["run lesson", "serve lesson", "teleop tandem", "replay run.mcap"])
def test_video_without_its_package_is_refused_before_anything_starts(
    command: str, cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    if "replay" in command:
        assert cellwright("run", "lesson", *SHORT, "--record", "run.mcap").status == 0
    monkeypatch.setitem(sys.modules, "av", None)
    before = {*Path().iterdir()}
    ran = cellwright(*command.split(), "--video", "a.mp4")
    message = "error: video: PyAV is not installed; run: pip install 'cellwright[video]'\n"
    assert (ran.status, ran.out, ran.err) == (2, "", message)
    assert {*Path().iterdir()} == before


@pytest.mark.parametrize(
    "command",
    [
        "run lesson --agent none --until 0.1 --video v.mp4",
        "run lesson --agent none --until 0.1 --quality fast",
        "run lesson camera.yaml --agent none --until 0.1",
        "serve lesson camera.yaml --until 0.1 --port 0",
        "eval lesson --with camera.yaml --seeds 1",
    ],
)
def test_unknown_rendering_backend_is_refused(
    command: str, cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    pose = "{xyz: [-0.3, 0.23, 1.7], rpy: [0, pi/2, 0]}"
    Path("camera.yaml").write_text(f"cellwright: {{sensors: {{over: {{type: rgb_camera, pose: {pose}}}}}}}\n")
    monkeypatch.setenv("CELLWRIGHT_RENDERING", "opengl")

    ran = cellwright(*command.split())

    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith("error: CELLWRIGHT_RENDERING=opengl: unknown backend; set one of egl, ")
    assert ran.err.count("\n") == 1
    assert [each.name for each in Path().iterdir()] == ["camera.yaml"]


@pytest.mark.slow
def test_run_writes_video(cellwright: CommandLine, tmp_path: Path) -> None:
    options = ("run", "lesson", "--agent", "lesson", "--until", "0.4", "--no-picture")
    ran = cellwright(*options, "--json", "--video", "a.mp4", *SMALL, "--video-camera", "-4,-3,3:0,0,0.6:40")
    result = json.loads(ran.out)
    assert result["videos"] == [{"file": "a.mp4", "length": 0.44, "frames": 11, "dropped": 0}]
    assert len(read(tmp_path / "a.mp4")) == 11
    assert result["state_hash"] == json.loads(cellwright(*options, "--json").out)["state_hash"]
    ran = cellwright(*options, "--video", "b.mp4", *SMALL, "--video-speed", "8")
    assert ran.out.splitlines()[-1] == "video       b.mp4, 0.1 s"


@pytest.mark.slow
def test_served_cell_writes_video(cellwright: CommandLine, tmp_path: Path) -> None:
    ran = cellwright(
        "serve", "lesson", "--port", "0", "--speed", "max", "--until", "0.2", "--video", "a.mp4", *SMALL, "--json"
    )
    assert (ran.status, json.loads(ran.out)["videos"][0]["frames"]) == (0, 6)
    assert len(read(tmp_path / "a.mp4")) == 6


@pytest.mark.slow
def test_robot_node_writes_video(cellwright: CommandLine, tmp_path: Path) -> None:
    options = ("--port", "0", "--sim-time", "--speed", "max", "--until", "0.2", "--json")
    ran = cellwright("teleop", "tandem", *options, "--video", "a.mp4", *SMALL)
    assert (ran.status, json.loads(ran.out)["videos"]) == (
        0,
        [{"file": "a.mp4", "length": 0.24, "frames": 6, "dropped": 0}],
    )
    first = read(tmp_path / "a.mp4")[0].astype(int)
    edge = np.concatenate([first[0], first[-1], first[:, 0], first[:, -1]])
    assert np.abs(first - np.median(edge, axis=0)).max() > 80  # the robot stands there, and not at the edge alone


@pytest.mark.slow
def test_full_disk_loses_video_and_keeps_run(cellwright: CommandLine, tmp_path: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("Linux has a disk that is always full")
    (tmp_path / "a.mp4").symlink_to("/dev/full")
    ran = cellwright("run", "lesson", "--agent", "none", "--until", "0.2", "--no-picture", "--video", "a.mp4", *SMALL)
    assert ran.status == 1
    assert ran.err.count("No space left on device") == 1
    assert "simulated   0.2 s" in ran.out


@pytest.mark.slow
def test_replay_writes_video_of_recording(cellwright: CommandLine, tmp_path: Path) -> None:
    cellwright(
        *("run", "lesson", "--agent", "lesson", "--until", "0.28", "--no-picture", *SMALL),
        *("--record", "run.mcap", "--video", "live.mp4"),
    )
    ran = cellwright("replay", "run.mcap", "--video", "replayed.mp4", *SMALL)
    assert (ran.status, ran.out) == (0, "video       replayed.mp4, 0.3 s\n")
    live, replayed = read(tmp_path / "live.mp4"), read(tmp_path / "replayed.mp4")
    assert len(live) == len(replayed) == 8
    for a, b in zip(live, replayed, strict=True):
        assert np.abs(a.astype(int) - b).mean() < 3  # the video codes the clock in the corner from earlier frames
    ran = cellwright("replay", "run.mcap", "--video", "b.mp4", *SMALL, "--start", "0.12", "--until", "0.2", "--json")
    assert json.loads(ran.out)["videos"] == [{"file": "b.mp4", "length": 0.12, "frames": 3, "dropped": 0}]
    ran = cellwright("replay", "run.mcap", "--video", "c.mp4", "--start", "50")
    assert (ran.status, ran.err.count("\n")) == (2, 1)
    assert ran.err == "error: --start 50: run.mcap ends at 0.280 s\n"
    for other in ("--serve", "--verify"):
        ran = cellwright("replay", "run.mcap", "--video", "c.mp4", other)
        assert (ran.status, "--video excludes playback and --verify" in ran.err) == (2, True)
