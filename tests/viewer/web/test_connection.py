"""Connection of the page to the server: there, gone, back, and refused."""

import threading
from typing import Any

import pytest

from cellwright.cell.cell import Cell
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.rendering.scene.scene import decode_frame, decode_scene, is_whole_frame
from cellwright.robot.node import RobotNode
from cellwright.util.errors import CellwrightError, RejectedCommandError, UnknownNameError
from cellwright.viewer.services.names import FRAME, SCENE
from cellwright.viewer.web import connection
from cellwright.viewer.web.connection import AwayError, ServerConnection
from tests.robot.robots import two_arms
from tests.support.cells import KITTING
from tests.support.waiting import TIMEOUT, wait_until
from tests.viewer.web.hosted import hosted


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


def test_connection_gets_frames_without_further_requests_and_asks_for_more_in_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(connection, "AHEAD", 4)
    with hosted(Cell(KITTING), steps=True) as server:
        link = ServerConnection(server.address)
        kinds: list[bool] = []
        for number in range(12):
            found = None
            while found is None:
                found = link.next_frame({}, TIMEOUT, is_first=number == 0)
            kinds.append(is_whole_frame(found[1]))
        assert kinds == [True] + [False] * 11
        link.close()


def test_connection_begins_new_stream_for_other_overlays() -> None:
    with hosted(Cell(KITTING)) as server:
        link = ServerConnection(server.address)

        def first(request: dict[str, Any]) -> tuple[dict[str, Any], memoryview]:
            found = link.next_frame(request, TIMEOUT, is_first=False)
            assert found is not None
            return found

        plain, forces = first({}), first({"contacts": True})
        assert "contacts" not in plain[0]
        assert "contacts" in forces[0]
        assert is_whole_frame(forces[1])
        assert decode_frame(forces[1]).equals(decode_frame(plain[1]))
        link.close()


def test_connection_gets_no_frame_after_end_of_stream() -> None:
    with hosted(Cell(KITTING)) as server:
        link = ServerConnection(server.address)
        assert link.next_frame({}, TIMEOUT, is_first=True) is not None
        link.end_stream()
        link.ask_data(FRAME)
        assert not link._frames
        wait_until(lambda: server._streams.due > 1e9, "no stream")
        link.close()


def test_connection_reports_refused_and_lost_stream() -> None:
    def fail(request: dict[str, Any]) -> dict[str, Any]:
        raise KeyError(request["ahead"])

    with hosted(Cell(KITTING)) as server:
        server.offer(FRAME, fail)
        link = ServerConnection(server.address)
        with pytest.raises(CellwrightError, match="KeyError"):
            link.next_frame({}, TIMEOUT, is_first=True)
    with pytest.raises(AwayError, match="the end"):
        wait_until(lambda: link.next_frame({}, TIMEOUT, is_first=False), "another frame")
