"""Tests of the process state that a program changes: it is restored after the program."""

from __future__ import annotations

import io
import locale
import os
import signal
import sys
import threading
from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from cellwright.running.run.agent_work import restored_environment


def upset(folder: Path) -> None:
    os.chdir(folder)
    np.seterr(all="raise")
    locale.setlocale(locale.LC_ALL, "C")
    sys.stdout = io.StringIO()
    sys.setrecursionlimit(50_000)
    if threading.current_thread() is threading.main_thread():
        signal.signal(signal.SIGINT, signal.SIG_IGN)


def state() -> tuple[object, ...]:
    numbers = (np.geterr(), sys.getrecursionlimit(), signal.getsignal(signal.SIGINT))
    return (Path.cwd(), *numbers, locale.setlocale(locale.LC_ALL), sys.stdout)


def test_environment_is_restored_even_after_error(tmp_path: Path) -> None:
    before = state()
    with restored_environment():
        upset(tmp_path)
        assert state() != before
    assert state() == before
    with suppress(KeyError), restored_environment():
        upset(tmp_path)
        raise KeyError
    assert state() == before


def test_signal_handlers_are_untouched_in_other_thread(tmp_path: Path) -> None:
    before, errors = state(), list[BaseException]()

    def work() -> None:
        try:
            with restored_environment():
                upset(tmp_path)
        except BaseException as error:
            errors.append(error)

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert not errors
    assert state() == before


def test_missing_working_folder_is_no_error(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    with restored_environment():
        os.chdir(tmp_path)
    assert Path.cwd() == tmp_path
