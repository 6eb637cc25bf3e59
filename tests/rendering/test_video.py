import math
import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from cellwright.rendering import video_size
from cellwright.rendering.camera import Camera
from cellwright.rendering.video import Video
from cellwright.rendering.video_options import VideoOptions
from cellwright.rendering.video_size import FrameQuality
from cellwright.rendering.worker import RenderingError
from tests.rendering.scenes_of_shapes import BALL, ball_at
from tests.rendering.worker.test_film import read
from tests.support.processes import is_running
from tests.support.quick_children import QUICK_DRAWING
from tests.support.waiting import TIMEOUT, wait_until

pytestmark = QUICK_DRAWING

CAMERA = Camera((0, -4, 2), (0, 0, 1), fov=math.radians(40))


def of_a_ball(file: Path) -> VideoOptions:
    return VideoOptions(file, size=(64, 48))


def left_of_red(pictures: list[np.ndarray]) -> list[float]:
    return [float(np.nonzero(picture[:, :, 0] > picture[:, :, 1] + 40.0)[1].mean()) for picture in pictures]


@pytest.mark.slow
def test_video_plays_given_frames(tmp_path: Path) -> None:
    films = []
    for name in ("a.mp4", "b.mp4"):
        video = Video(of_a_ball(tmp_path / name), BALL, ball_at(0, 0, 1), CAMERA)
        for number in range(20):
            assert video.take(ball_at(number / 20 - 0.5, 0, 1), CAMERA, "ball")
        video.close()
        assert (video.made["length"], video.dropped, video.error) == (0.8, 0, "")
        films.append(read(tmp_path / name))
    assert len(films[0]) == 20
    places = left_of_red(films[0])
    assert places == sorted(places)
    assert places[-1] - places[0] > 10
    assert np.array_equal(films[0], films[1])  # the same frames, the same pictures


def test_video_without_size_takes_smaller_one_where_drawing_is_slow(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video_size, "QUALITIES", (FrameQuality((64, 48), 2), FrameQuality((32, 24), 1)))
    monkeypatch.setattr(video_size, "LONGEST", 0.0)
    video = Video(VideoOptions(tmp_path / "a.mp4"), BALL, ball_at(0, 0, 1), CAMERA)
    assert video.take(ball_at(0, 0, 1), CAMERA)
    video.close()
    assert re.fullmatch(
        r".*/a\.mp4: 32x24, since a frame of 64x48 takes \d\.\d\d s here; --video-size sets another", video.choice
    )
    assert video.options.size == (32, 24)
    assert read(tmp_path / "a.mp4")[0].shape == (24, 32, 3)


@pytest.mark.slow
def test_video_without_waiting_repeats_picture(tmp_path: Path) -> None:
    video = Video(of_a_ball(tmp_path / "a.mp4"), BALL, ball_at(0, 0, 1), CAMERA)
    os.kill(video._worker._process.pid, signal.SIGSTOP)
    took = [video.take(ball_at(number / 40 - 0.5, 0, 1), CAMERA, waits=False) for number in range(20)]
    os.kill(video._worker._process.pid, signal.SIGCONT)
    assert video._worker.wait_for_room(TIMEOUT)
    video.take(ball_at(0.5, 0, 1), CAMERA, waits=False)
    video.close()
    assert took.count(True) + 1 == video.taken < 20
    assert video.taken + video.dropped == 21
    pictures = read(tmp_path / "a.mp4")
    assert len(pictures) == 21  # time is unchanged
    places = left_of_red(pictures)
    assert places[10] == pytest.approx(places[19], abs=0.6)
    assert places[20] > places[19] + 3


@pytest.mark.slow
def test_full_disk_ends_video_only(tmp_path: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("Linux has a disk that is always full")
    (tmp_path / "a.mp4").symlink_to("/dev/full")
    video = Video(of_a_ball(tmp_path / "a.mp4"), BALL, ball_at(0, 0, 1), CAMERA)
    for number in range(300):
        if not video.take(ball_at(math.sin(number), 0, 1), CAMERA):
            break
    with pytest.raises(RenderingError, match="No space left on device"):
        video.close()
    assert not video.take(ball_at(0, 0, 1), CAMERA)


@pytest.mark.slow
def test_video_of_killed_process_is_playable(tmp_path: Path) -> None:
    video = Video(of_a_ball(tmp_path / "a.mp4"), BALL, ball_at(0, 0, 1), CAMERA)
    for _ in range(90):
        video.take(ball_at(0, 0, 1), CAMERA)
    os.kill(video._worker._process.pid, signal.SIGKILL)
    with pytest.raises(RenderingError, match="has ended"):
        video.close()
    assert 30 <= len(read(tmp_path / "a.mp4")) <= 90


_GIVES_FRAMES = """
import os, signal, sys
from pathlib import Path
from tests.rendering.scenes_of_shapes import BALL, ball_at
from tests.rendering.test_video import CAMERA, of_a_ball
from cellwright.rendering import video_size
from cellwright.rendering.video import Video
from cellwright.rendering.video_options import VideoOptions

video = Video(of_a_ball(Path(sys.argv[1])), BALL, ball_at(0, 0, 1), CAMERA)
for _ in range(30):
    video.take(ball_at(0, 0, 1), CAMERA)
print(video._worker._process.pid, flush=True)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.slow
def test_video_of_killed_caller_is_playable(tmp_path: Path) -> None:
    file = tmp_path / "a.mp4"
    ran = subprocess.run(
        [sys.executable, "-c", _GIVES_FRAMES, str(file)],
        cwd=Path(__file__).parents[2],
        stdout=subprocess.PIPE,
        timeout=TIMEOUT,
        check=False,
    )
    assert ran.returncode == -signal.SIGKILL
    wait_until(lambda: not is_running(int(ran.stdout)), "end of the process that draws")  # on its own
    assert len(read(file)) == 30
    assert file.read_bytes().index(b"moov") < file.read_bytes().index(b"mdat")  # and has finished the file


@pytest.mark.slow
def test_unwritable_video_is_refused(tmp_path: Path) -> None:
    with pytest.raises(RenderingError, match="No such file or directory"):
        Video(of_a_ball(tmp_path / "no" / "a.mp4"), BALL, ball_at(0, 0, 1), CAMERA)
