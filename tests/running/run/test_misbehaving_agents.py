"""Tests of programs that fail in every way: the run has a result, and the process goes on unchanged."""

from __future__ import annotations

import asyncio
import os
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cellwright.cell.cell import Cell
from cellwright.clients.client.client import Client
from cellwright.running.run import Outcome
from cellwright.util.errors import RunEndedError, UsageError
from tests.running.run.test_cells import deliver, work
from tests.support.cells import KITTING


class OwnError(BaseException):
    """An error that `except Exception` does not catch."""


class UnsaidError(Exception):
    """An error whose text cannot be read."""

    def __str__(self) -> str:
        raise RuntimeError

    __repr__ = __str__


def in_a_callback(error: BaseException) -> Callable[[Client], object]:
    def script(client: Client) -> None:
        def fail(_message: object) -> None:
            raise error

        client.subscribe("/clock", fail)
        client.sleep(0.1)

    return script


def at_once(error: BaseException) -> Callable[[Client], object]:
    def script(_client: Client) -> None:
        raise error

    return script


@pytest.mark.parametrize("how", [at_once, in_a_callback])
@pytest.mark.parametrize(
    "error", [OwnError, GeneratorExit, asyncio.CancelledError, MemoryError, RecursionError, StopIteration]
)
def test_any_error_of_agent_is_crash_and_score_stands(
    error: type[BaseException], how: Callable[[BaseException], Callable[[Client], object]]
) -> None:
    result = work(how(error("mine")))
    assert result.outcome is Outcome.CRASHED
    assert result.error.splitlines()[-1].endswith(f"{error.__name__}: mine")
    assert "working.py" not in result.error


def test_error_text_of_agent_is_printable_and_bounded() -> None:
    text = work(at_once(RuntimeError("\ud800 \x1b[2J\n\x00 <b>" + 5_000_000 * "long"))).error
    assert len(text) < 30_000
    assert all(sign.isprintable() or sign == "\n" for sign in text)
    text.encode()
    assert "\\ud800 \\x1b[2J\n\\x00 <b>longlong" in text


@pytest.mark.parametrize("error", [UnsaidError(), SystemExit(UnsaidError())])
def test_error_without_text_is_crash(error: BaseException) -> None:
    result = work(at_once(error))
    assert (result.outcome, "UnsaidError" in result.error) == (Outcome.CRASHED, True)


def test_endless_recursion_is_crash() -> None:
    def script(client: Client) -> object:
        return script(client)

    assert work(script).outcome is Outcome.CRASHED


def test_error_in_callback_caught_by_agent_does_not_end_run() -> None:
    def script(client: Client) -> None:
        def fail(_message: object) -> None:
            raise OwnError

        leave = client.subscribe("/clock", fail)
        with pytest.raises(OwnError):
            client.sleep(0.1)
        leave()
        deliver(client)

    assert work(script).outcome is Outcome.DONE


def test_process_state_changed_by_agent_is_restored(tmp_path: Path) -> None:
    folder, numbers = Path.cwd(), np.geterr()

    def script(client: Client) -> None:
        os.chdir(tmp_path)
        np.seterr(all="raise")
        np.random.seed(1)  # noqa: NPY002
        deliver(client)

    assert work(script).state_hash == work(deliver).state_hash
    assert (Path.cwd(), np.geterr()) == (folder, numbers)


def test_client_refuses_calls_from_other_threads() -> None:
    errors: list[BaseException] = []

    def script(client: Client) -> None:
        def meddle() -> None:
            for act in (
                lambda: client.sleep(1.0),
                lambda: client.time,
                lambda: client.control_agv(1, "order_0_kit_0"),
                lambda: client.subscribe("/clock", print),
                lambda: client.send_arm([]),
            ):
                try:
                    act()
                except BaseException as error:
                    errors.append(error)

        thread = threading.Thread(target=meddle)
        thread.start()
        thread.join()
        deliver(client)

    assert work(script).state_hash == work(deliver).state_hash
    assert len(errors) == 5
    assert all(
        isinstance(error, UsageError) and "works in the thread that created it" in str(error) for error in errors
    )


def test_client_used_after_end_changes_nothing() -> None:
    kept: list[Client] = []
    cell = Cell(KITTING)

    def script(client: Client) -> None:
        kept.append(client)
        deliver(client)

    work(script, cell)
    before = cell.state_hash()
    with pytest.raises(RunEndedError):
        kept[0].sleep(1.0)
    with pytest.raises(RunEndedError):
        kept[0].control_agv(1, "")
    kept[0].close()
    assert cell.state_hash() == before
