"""What will be there later: in time, too late, or never."""

import threading

import pytest

from cellwright.rendering.worker.client import Pending
from cellwright.util.errors import RenderingError


def test_what_has_come_is_there_for_all_who_ask() -> None:
    pending: Pending[int] = Pending()
    before = pending.is_done
    pending.settle(7)
    assert (before, pending.is_done) == (False, True)
    assert [pending.result(), pending.result(0.0)] == [7, 7]


def test_who_asks_early_waits() -> None:
    pending: Pending[str] = Pending()
    threading.Timer(0.05, pending.settle, ["drawn"]).start()
    assert pending.result(60.0) == "drawn"


def test_why_it_will_never_be_there_is_said_each_time() -> None:
    pending: Pending[int] = Pending()
    pending.settle(None, "the disk is full")
    for _ in range(2):
        with pytest.raises(RenderingError, match="the disk is full"):
            pending.result()


def test_nobody_waits_for_ever_who_does_not_want_to() -> None:
    with pytest.raises(RenderingError, match=r"not answered within 0\.01 s"):
        Pending[int]().result(0.01)
