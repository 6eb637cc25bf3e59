"""Domains of tests: distinct between processes, free after the end of a process, and not used again at once."""

import os
import socket
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Iterator

import pytest

from tests.ros2 import domains
from tests.ros2.domains import TakenDomain
from tests.support.waiting import wait_until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="sockets with names but without files are Linux's")

FIRST = 1000 + os.getpid() * 10
"""First of ten domains that no other process takes."""

TAKE = f"""
import sys
from tests.ros2 import domains

domains.DOMAINS = range({FIRST}, {FIRST + 10})
taken = domains.TakenDomain()
print(taken.number, flush=True)
sys.stdin.read()
"""


@pytest.fixture
def take(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[[], TakenDomain]]:
    """Function that takes one of ten domains."""
    resting: deque[socket.socket] = deque()
    monkeypatch.setattr(domains, "DOMAINS", range(FIRST, FIRST + 10))
    monkeypatch.setattr(domains, "_resting", resting)
    taken: list[TakenDomain] = []

    def take_one() -> TakenDomain:
        taken.append(TakenDomain())
        return taken[-1]

    yield take_one
    for each in taken:
        each.lock.close()


def test_domain_of_other_process_is_taken_until_that_is_killed(take: Callable[[], TakenDomain]) -> None:
    mine = {take().number for _ in range(5)}
    command = [sys.executable, "-c", TAKE]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        theirs = int(other.stdout.readline())
        mine |= {take().number for _ in range(4)}
        assert len(mine) == 9
        assert {theirs} == {*domains.DOMAINS} - mine
        other.kill()
    assert take().number == theirs


def test_domain_given_back_rests_until_others_were_used(take: Callable[[], TakenDomain]) -> None:
    first = take()
    first.give_back()
    others = [take() for _ in range(9)]
    assert first.number not in {each.number for each in others}
    for each in others[:8]:
        each.give_back()
    assert take().number == first.number


def test_domain_is_waited_for_while_all_are_taken(
    take: Callable[[], TakenDomain], monkeypatch: pytest.MonkeyPatch
) -> None:
    taken = [take() for _ in range(10)]

    def wait(condition: Callable[[], int], what: str) -> int:
        return wait_until(condition, what, between=taken[3].lock.close)

    monkeypatch.setattr(domains, "wait_until", wait)
    assert take().number == taken[3].number
