"""Tests of the session: it runs, serves, records and films; and few calls lie before an agent's start."""

from __future__ import annotations

import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import pytest

import cellwright
from cellwright.cli.main import main
from cellwright.clients.client import Client
from cellwright.running.run import Outcome, RunOptions, Session, run_cell
from cellwright.util.errors import RunEndedError, UsageError
from tests.support.cells import BARE, KITTING

FRAMES = 7
"""Maximum of our calls on the stack when an agent starts, including main() and the agent itself."""


class Ends:
    """Ends the competition after a while."""

    def run(self, client: Client) -> None:
        client.start_competition()
        client.sleep(0.3)
        client.end_competition()


def test_run_cell_and_session_give_same_state() -> None:
    with Session(cellwright.Cell(KITTING)) as session:
        result = session.run(Ends())
    assert result.state_hash == run_cell(cellwright.Cell(KITTING), Ends()).state_hash
    assert result is session.result


def test_run_without_program_clients_or_end_is_refused() -> None:
    with Session(BARE) as session, pytest.raises(UsageError, match="until: a run without an agent needs an end"):
        session.run()
    assert Session(BARE).run(until=0.25).steps == 125


def test_stop_request_ends_agent() -> None:
    class Waits:
        def run(self, client: Client) -> None:
            client.subscribe("/clock", lambda _: session.stop.request("enough"))
            with pytest.raises(RunEndedError, match="enough"):
                client.sleep(10.0)
            client.sleep(1.0)

    with Session(BARE) as session:
        assert session.run(Waits()).outcome is Outcome.UNTIL


def test_client_advances_time_and_observers_follow() -> None:
    seen: list[str] = []

    @contextmanager
    def observer(session: Session) -> Iterator[None]:
        seen.append("begun")
        yield
        assert session.result is not None
        seen.append(f"{session.result.simulated:g} s")

    with Session(cellwright.Cell(KITTING), options=RunOptions(observers=[observer])) as session:
        client = session.client()
        assert isinstance(client, Client)
        client.sleep(0.5)
        assert seen == ["begun"]
    assert seen == ["begun", "0.5 s"]


def test_slow_observer_does_not_speed_up_run() -> None:
    @contextmanager
    def dawdle(_: Session) -> Iterator[None]:
        threading.Event().wait(0.4)
        yield

    with Session(cellwright.Cell(BARE), rate=2.0, options=RunOptions(observers=[dawdle])) as session:
        result = session.run(until=0.4)
    assert result.real_time_factor < 2.1  # a slow machine falls behind, none runs ahead


def test_few_stack_frames_lie_between_command_line_and_agent(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "counts.py").write_text(
        "import sys, traceback\n"
        "class Counts:\n"
        "    def run(self, client):\n"
        "        self.__class__.frames.extend(each.filename for each in traceback.extract_stack())\n"
        "    frames = sys.modules.setdefault('frames_of_the_agent', [])\n"
    )
    monkeypatch.chdir(tmp_path)
    frames: list[str] = []
    monkeypatch.setitem(sys.modules, "frames_of_the_agent", frames)
    assert main(["run", "lesson", "--agent", "counts.py:Counts", "--no-picture"]) == 1, "it gives up at once"
    ours = [each for each in frames if "/cellwright/" in each.replace("\\", "/") or each.endswith("counts.py")]
    assert 4 <= len(ours) <= FRAMES, ours


@pytest.mark.parametrize("target", [BARE, "tandem"])
def test_closed_session_is_refused(target: cellwright.Trial | str) -> None:
    session = Session(target)
    with pytest.raises(UsageError, match="client: the session is not open"):
        session.client()
    session.run(until=0.1)
    for call in (partial(session.run, until=0.1), session.client, session.reset, session.__enter__):
        with pytest.raises(UsageError, match="the session is closed"):
            call()
    assert session.number == 1
