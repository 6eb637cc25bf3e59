"""Poller of the page: scenes and frames in order, from a server that is there, gone, or wrong."""

import threading
from functools import partial
from typing import Any

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.scene import decode_frame, encode_scene
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import FRAME, SCENE
from cellwright.viewer.services.scene import SceneServices, ServedScene
from cellwright.viewer.web.connection import AwayError, ServerConnection
from cellwright.viewer.web.poller import MAX_RESULTS, NewFrame, NewPanel, NewScene, PollResult, StatePoller
from tests.support.cells import KITTING
from tests.support.waiting import TIMEOUT, wait_until
from tests.viewer.web.hosted import hosted


def test_poller_gets_scene_once_and_frames_after_it() -> None:
    with hosted(Cell(KITTING)) as server:
        poller = StatePoller(ServerConnection(server.address), lambda: {"contacts": True})
        poller.is_watched = True
        poller.start()
        scene = poller.results.get(timeout=TIMEOUT)
        assert isinstance(scene, NewScene)
        assert scene.about["kind"] == "cell"
        for _ in range(3):
            frame = poller.results.get(timeout=TIMEOUT)
            assert isinstance(frame, NewFrame)
            assert "contacts" in frame.answer
            assert frame.wall > 0
        poller.close()


class Pause(threading.Event):
    """Pause between two polls that records its length, and ends when the test ends it."""

    def __init__(self) -> None:
        super().__init__()
        self.lengths: list[float | None] = []

    def wait(self, timeout: float | None = None) -> bool:
        self.lengths.append(timeout)
        return super().wait(TIMEOUT)


GOOD_SCENE = encode_scene(Scene("a", ("world",), (), ()))


class Link:
    """Fake connection whose frames come as long as they are asked for."""

    address = ("", 0)

    def __init__(self, data: bytes, scene: bytes) -> None:
        self.calls: list[str] = []
        self._data, self._scene = memoryview(data), memoryview(scene)

    def ask_data(self, service: str, **request: Any) -> tuple[dict[str, Any], memoryview]:
        self.calls.append(f"{service} {sorted(request)}")
        if service == SCENE:
            return {"digest": "a"}, self._scene
        return self._answer, self._data

    def next_frame(
        self, request: dict[str, Any], _timeout: float, *, is_first: bool
    ) -> tuple[dict[str, Any], memoryview] | None:
        self.calls.append(f"first {request}" if is_first else "next")
        return {**self._answer, "panel": {"kind": "any"}}, self._data

    def end_stream(self) -> None:
        self.calls.append("end")

    @property
    def _answer(self) -> dict[str, Any]:
        return {"digest": "a", "sequence": 1}


def fake() -> tuple[Link, StatePoller]:
    """Poller of a fake connection; the test calls it in place of its thread."""
    frame = SceneFrame(0, np.array([[0, 0, 0, 1, 0, 0, 0]], np.float32), np.array([True]))
    link = Link(frame.encode(), GOOD_SCENE)
    return link, StatePoller(link, lambda: {"sensors": True})  # type: ignore[arg-type]


def results(poller: StatePoller) -> list[PollResult]:
    """Take all results."""
    return [poller.results.get() for _ in range(poller.results.qsize())]


def test_poller_follows_stream_only_while_browser_is_connected() -> None:
    link, poller = fake()
    assert poller._look() == 2.0
    assert link.calls == [f"{FRAME} []", f"{SCENE} []"]
    poller.is_watched = True
    assert (poller._look(), poller._look()) == (0.0, 0.0)
    poller.is_watched = False
    assert poller._look() == 2.0
    assert link.calls[2:] == ["first {'sensors': True}", "next", "end", f"{FRAME} ['since']"]
    poller.is_watched = True
    poller._look()
    assert link.calls[-1] == "first {'sensors': True}", "it has missed frames"
    kinds = [type(each) for each in results(poller)]
    assert kinds == [NewScene, NewFrame, NewFrame, NewPanel, NewFrame, NewPanel, NewFrame, NewFrame, NewPanel]


def test_poller_takes_no_frame_while_page_is_slow() -> None:
    link, poller = fake()
    poller.is_watched = True
    while poller.results.qsize() < MAX_RESULTS:
        assert poller._look() == 0.0
    count = len(link.calls)
    assert poller._look() == pytest.approx(0.05)
    assert len(link.calls) == count
    results(poller)
    assert poller._look() == 0.0


def test_poller_without_browser_polls_rarely_and_at_once_when_woken() -> None:
    with hosted(Cell(KITTING)) as server:
        poller = StatePoller(ServerConnection(server.address), dict)
        pause = poller._wake = Pause()
        poller.start()
        wait_until(lambda: len(pause.lengths) == 1, "first pause")
        assert pause.lengths[0] == 2.0
        results(poller)
        poller.is_watched = True
        poller.wake()
        assert isinstance(poller.results.get(timeout=TIMEOUT), NewFrame)
        assert len(pause.lengths) == 1
        poller.close()


@pytest.mark.parametrize(
    "answer",
    [
        {},
        {"digest": "a", "scene": "x"},
        ({}, b""),
        ({"digest": "a"}, b""),
        ({"digest": 7}, GOOD_SCENE),
        ({"digest": "a"}, b"AAA"),
    ],
)
def test_poller_takes_invalid_answers_as_disconnect(answer: Any) -> None:
    with hosted(Cell(KITTING)) as server:
        server.offer(SCENE, lambda _request: answer)
        server.offer(FRAME, lambda _request: answer)
        poller = StatePoller(ServerConnection(server.address), dict)
        poller.start()
        found = poller.results.get(timeout=TIMEOUT)
        assert isinstance(found, CellwrightError)
        poller.close()


@pytest.mark.slow
def test_poller_drops_frames_of_another_scene_and_invalid_runs() -> None:
    cell = Cell(KITTING)
    services = SceneServices(ServedScene(cell))
    with hosted(cell) as server:
        good, data = services.frame({})
        other = SceneFrame(0, np.zeros((2, 7), np.float32), np.array([True, True])).encode()
        changes = decode_frame(data).encode(decode_frame(data))
        wrongs: list[tuple[dict[str, Any], bytes]] = [
            (good, other),
            (good, changes),
            (good, data[:-1]),
            ({**good, "run": "x"}, data),
            ({**good, "run": None}, data),
            ({**good, "sequence": None}, data),
        ]
        for wrong in wrongs:
            server.offer(FRAME, partial(answered, wrong))
            poller = StatePoller(ServerConnection(server.address), dict)
            poller.start()
            assert isinstance(poller.results.get(timeout=TIMEOUT), NewScene)
            assert isinstance(poller.results.get(timeout=TIMEOUT), AwayError), wrong
            server.offer(FRAME, services.frame_or_stream)
            poller.wake()
            found = poller.results.get(timeout=TIMEOUT)
            while isinstance(found, AwayError):
                found = poller.results.get(timeout=TIMEOUT)
            assert isinstance(found, NewScene | NewFrame), "it finds back"
            poller.close()


def answered(answer: tuple[dict[str, Any], bytes], _request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    return answer
