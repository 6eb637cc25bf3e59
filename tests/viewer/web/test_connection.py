"""Connection of the page to the server: there, gone, back, and refused."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.middleware.server import Server
from cellwright.rendering.scene import Scene, SceneFrame
from cellwright.rendering.scene.scene import decode_frame, decode_scene, encode_scene, is_whole_frame
from cellwright.robot.node import RobotNode
from cellwright.util.errors import CellwrightError, RejectedCommandError, UnknownNameError
from cellwright.viewer.services.names import SCENE
from cellwright.viewer.services.scene import SceneServices, ServedScene, ViewedNode
from cellwright.viewer.web.connection import AwayError, NewFrame, NewScene, ServerConnection, StatePoller
from tests.robot.robots import two_arms
from tests.support.cells import KITTING
from tests.support.waiting import TIMEOUT, wait_until


@contextmanager
def hosted(served: ViewedNode, port: int = 0) -> Iterator[Server]:
    """Server in a thread of its own, where no time passes."""
    server = Server(served, port=port)
    SceneServices(ServedScene(served)).offer(server)
    is_over = threading.Event()

    def serve() -> None:
        while not is_over.is_set():
            server.wait(0.005)

    thread = threading.Thread(target=serve)
    thread.start()
    try:
        yield server
    finally:
        is_over.set()
        thread.join()
        server.close("the end")


def test_connection_answers_requests_and_raises_refusals() -> None:
    cell = Cell(KITTING)

    def refuse(request: dict[str, Any]) -> dict[str, Any]:
        raise RejectedCommandError(f"not {request['what']}")

    with hosted(cell) as server:
        server.offer("no", refuse)
        link = ServerConnection(server.address)
        answer, data = link.ask_data(SCENE)
        assert set(answer) == {"digest", "about"}
        assert decode_scene(bytes(data)).name == "kitting"
        with pytest.raises(CellwrightError, match=r"cellwright/scene: .*not a JSON object"):
            link.ask(SCENE)
        server.offer("json", dict)
        with pytest.raises(CellwrightError, match=r"json: expected DATA \(got ANSWER\); use the same version"):
            link.ask_data("json")
        assert link.is_there
        assert link.welcome["trial"] == "kitting"
        with pytest.raises(RejectedCommandError, match="not now"):
            link.ask("no", what="now")
        with pytest.raises(UnknownNameError):
            link.ask("cellwright/nothing")
        assert link.call("/ariac/start_competition", TriggerRequest()).success
        with pytest.raises(UnknownNameError, match="unknown service"):
            link.call("/nothing", TriggerRequest())
        link.close()
        assert not link.is_there


def test_connection_reconnects_to_restarted_server() -> None:
    with hosted(Cell(KITTING)) as server:
        address = server.address
        link = ServerConnection(address)
        link.ask_data(SCENE)
    with pytest.raises(AwayError, match="the end"):
        link.ask_data(SCENE)
    with pytest.raises(AwayError, match="answers"):
        link.ask_data(SCENE)
    with pytest.raises(AwayError):
        link.call("/ariac/start_competition", TriggerRequest())
    with hosted(RobotNode(two_arms()), address[1]):
        assert link.ask_data(SCENE)[0]["about"]["kind"] == "robot"
    link.close()


def test_connection_in_several_threads_gives_each_its_answers() -> None:
    wrong: list[int] = []
    with hosted(Cell(KITTING)) as server:
        server.offer("echo", lambda request: request)
        link = ServerConnection(server.address)

        def ask(first: int) -> None:
            wrong.extend(number for number in range(first, first + 50) if link.ask("echo", n=number) != {"n": number})

        threads = [threading.Thread(target=ask, args=(1000 * number,)) for number in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        link.close()
    assert wrong == []


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


def test_poller_without_browser_polls_rarely(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellwright.viewer.web.connection.time", SimpleNamespace(perf_counter=lambda: 1.0))
    with hosted(Cell(KITTING)) as server:
        poller = StatePoller(ServerConnection(server.address), dict)
        pause = poller._wake = Pause()
        poller.start()
        wait_until(lambda: len(pause.lengths) == 1, "first pause")
        assert pause.lengths[0] == 2.0
        poller.is_watched = True
        poller.wake()
        wait_until(lambda: len(pause.lengths) == 2, "second pause", seen=lambda: pause.lengths)
        assert pause.lengths[1] == pytest.approx(1 / 20)
        poller.close()


GOOD_SCENE = encode_scene(Scene("a", ("world",), (), ()))


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
        server.offer("cellwright/frame", lambda _request: answer)
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
            server.offer("cellwright/frame", partial(answered, wrong))
            poller = StatePoller(ServerConnection(server.address), dict)
            poller.start()
            assert isinstance(poller.results.get(timeout=TIMEOUT), NewScene)
            assert isinstance(poller.results.get(timeout=TIMEOUT), AwayError), wrong
            server.offer("cellwright/frame", services.frame)
            poller.wake()
            found = poller.results.get(timeout=TIMEOUT)
            while isinstance(found, AwayError):
                found = poller.results.get(timeout=TIMEOUT)
            assert isinstance(found, NewScene | NewFrame), "it finds back"
            poller.close()


def answered(answer: tuple[dict[str, Any], bytes], _request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
    return answer


def test_poller_asks_for_changes_and_for_whole_frame_after_connection_loss() -> None:
    cell = Cell(KITTING)
    services = SceneServices(ServedScene(cell))
    requests: list[dict[str, Any]] = []
    sent: list[bytes] = []

    def note(request: dict[str, Any]) -> tuple[dict[str, Any], bytes]:
        answer, data = services.frame(request)
        requests.append(request)
        sent.append(data)
        return answer, data

    with hosted(cell) as server:
        server.offer("cellwright/frame", note)
        poller = StatePoller(ServerConnection(server.address), dict)
        poller._ask()
        poller._ask()
        assert requests[0] == requests[1] == {}, "there is no scene before the first answer"
        assert [*map(is_whole_frame, sent)] == [True, True, False]
        assert requests[2].keys() == {"since"}
        poller._link.close()  # as another server at the same address would
        server.offer("cellwright/frame", SceneServices(ServedScene(cell)).frame)
        poller._ask()
        server.offer("cellwright/frame", note)
        poller._ask()
        assert is_whole_frame(sent[-1])
        results = [poller.results.get(timeout=TIMEOUT) for _ in range(5)]
        frames = [each.frame for each in results if isinstance(each, NewFrame)]
        assert len(frames) == 4
        assert all(frame.equals(frames[0]) for frame in frames)
        poller._link.close()
