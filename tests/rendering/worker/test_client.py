import math
import os
import signal
import subprocess
import sys
from collections.abc import Iterator

import numpy as np
import pytest

from cellwright.rendering.backend import BACKEND
from cellwright.rendering.camera import Camera
from cellwright.rendering.picture import CastRenderer, PictureRequest
from cellwright.rendering.worker import RenderingError
from cellwright.rendering.worker.client import RenderWorker
from tests.rendering.scenes_of_shapes import BALL, ball_at, skip_without_opengl
from tests.support.quick_children import QUICK_DRAWING
from tests.support.waiting import TIMEOUT

CAMERA = Camera((0, -4, 2), (0, 0, 1), fov=math.radians(40))


@pytest.fixture(scope="module")
def worker() -> Iterator[RenderWorker]:
    with RenderWorker(BALL) as worker:
        skip_without_opengl(worker)
        yield worker


def is_red(picture: np.ndarray) -> np.ndarray:
    return np.asarray(picture[:, :, 0] > picture[:, :, 1] + 40.0)


def test_worker_picture_resembles_ray_picture(worker: RenderWorker) -> None:
    assert "OpenGL" in worker.ready.result(TIMEOUT)
    frame = ball_at(0.3, 0, 1)
    drawn = worker.colour(frame, PictureRequest(CAMERA, 160, 120, samples=4)).result(TIMEOUT).astype(float)
    cast = CastRenderer(BALL).colour(frame, PictureRequest(CAMERA, 160, 120))
    assert drawn.shape == (120, 160, 3)
    assert (is_red(drawn) ^ is_red(cast)).mean() < 0.01  # a rim of pixels
    assert np.abs(drawn - cast).mean() < 8  # of 255: light, floor, tiles, haze and sky


def test_worker_depths_equal_ray_depths(worker: RenderWorker) -> None:
    frame = ball_at(0.3, 0, 1)
    drawn = worker.depth(frame, PictureRequest(CAMERA, 64, 48)).result(TIMEOUT)
    cast = CastRenderer(BALL).depth(frame, PictureRequest(CAMERA, 64, 48))
    assert drawn.dtype == np.float32
    both = np.isfinite(drawn) & np.isfinite(cast) & (cast < 40)
    assert np.isinf(drawn[0]).all()
    assert both.mean() > 0.5
    apart = np.abs(drawn[both] - cast[both])
    assert np.quantile(apart, 0.97) < 0.008  # [m]: the ball has 32 x 16 facets
    assert drawn[24, 37] == pytest.approx(cast[24, 37], abs=0.01)


def test_worker_draws_shown_bodies_at_their_poses(worker: RenderWorker) -> None:
    gone = worker.colour(ball_at(0, 0, 1, shown=False), PictureRequest(CAMERA, 160, 120)).result(TIMEOUT)
    left, right = (
        worker.colour(ball_at(x, 0, 1), PictureRequest(CAMERA, 160, 120)).result(TIMEOUT) for x in (-0.5, 0.5)
    )
    assert not is_red(gone).any()
    assert np.nonzero(is_red(left))[1].mean() < 70 < 90 < np.nonzero(is_red(right))[1].mean()


def test_worker_draws_without_shadows_on_request(worker: RenderWorker) -> None:
    above = Camera((0.01, 0, 8), (0, 0, 0), fov=math.radians(50))
    with_them, without = (
        worker.colour(ball_at(0, 0, 1), PictureRequest(above, 120, 90, shadows=shadows)).result(TIMEOUT).astype(float)
        for shadows in (True, False)
    )
    assert (without.mean(axis=2) - with_them.mean(axis=2) > 25).sum() > 30


def test_same_frame_gives_same_picture(worker: RenderWorker) -> None:
    pictures = [worker.colour(ball_at(0, 0, 1), PictureRequest(CAMERA, 160, 120)) for _ in range(3)]
    assert len({pending.result(TIMEOUT).tobytes() for pending in pictures}) == 1


def test_light_shared_by_cameras_is_of_drawn_frame(worker: RenderWorker) -> None:
    above = Camera((0.01, 0, 8), (0, 0, 0), fov=math.radians(50))

    def drawn(x: float, camera: Camera) -> bytes:
        return (
            worker.colour(ball_at(x, 0, 1), PictureRequest(camera, 80, 60, about=(0, 0, 0))).result(TIMEOUT).tobytes()
        )

    alone = {x: drawn(x, above) for x in (0.0, 0.5)}
    assert alone[0.0] != alone[0.5]
    together = [(x, drawn(x, CAMERA), drawn(x, above)) for x in (0.0, 0.5, 0.0)]
    assert [picture for _, _, picture in together] == [alone[x] for x, _, _ in together]


def test_failed_picture_is_reported_and_others_are_drawn(worker: RenderWorker) -> None:
    bad, good = (
        worker.colour(ball_at(0, 0, 1), PictureRequest(CAMERA, -3, 120)),
        worker.depth(ball_at(0, 0, 1), PictureRequest(CAMERA, 8, 6)),
    )
    with pytest.raises(RenderingError, match="-3"):
        bad.result(TIMEOUT)
    assert good.result(TIMEOUT).shape == (6, 8)


@QUICK_DRAWING
def test_killed_worker_fails_pending_and_later_requests() -> None:
    with RenderWorker(BALL, max_pending=2) as worker:
        worker.ready.result(TIMEOUT)
        os.kill(worker._process.pid, signal.SIGSTOP)
        waiting = [worker.depth(ball_at(0, 0, 1), PictureRequest(CAMERA, 8, 6)) for _ in range(2)]
        assert not worker.has_room
        assert not worker.wait_for_room(0.01)
        with pytest.raises(TimeoutError):
            waiting[0].result(0.01)
        os.kill(worker._process.pid, signal.SIGKILL)
        for pending in waiting:
            with pytest.raises(RenderingError, match="has ended"):
                pending.result(TIMEOUT)
        assert worker.error
        with pytest.raises(RenderingError, match="has ended"):
            worker.depth(ball_at(0, 0, 1), PictureRequest(CAMERA, 8, 6)).result(TIMEOUT)


@pytest.mark.slow
@pytest.mark.parametrize("backend", ["rays", "osmesa"])
def test_worker_without_opengl_draws_with_rays(backend: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv(BACKEND, backend)
    with RenderWorker(BALL) as worker:
        renderer = worker.ready.result(TIMEOUT)
        assert renderer == "rays" or (backend == "osmesa" and "OpenGL" in renderer)
        picture = worker.colour(ball_at(0, 0, 1), PictureRequest(CAMERA, 40, 30, samples=1)).result(TIMEOUT)
        assert is_red(picture).any()


@pytest.mark.slow
def test_worker_client_loads_no_graphics_library() -> None:
    program = (
        "import sys\nfrom cellwright.rendering.worker import RenderWorker\n"
        "assert not {'OpenGL', 'av', 'matplotlib'} & {*sys.modules}\n"
    )
    subprocess.run([sys.executable, "-c", program], check=True, timeout=TIMEOUT)
