from functools import partial
from threading import Thread

from cellwright.engine.clock import Inbox


def test_inbox_executes_commands_in_order() -> None:
    inbox = Inbox()
    got: list[int] = []
    for number in range(5):
        inbox.put(partial(got.append, number))
    inbox.empty()
    assert not inbox
    assert got == [0, 1, 2, 3, 4]


def test_command_put_during_empty_waits_for_next_call() -> None:
    inbox = Inbox()
    got: list[int] = []

    def again() -> None:
        got.append(len(got))
        inbox.put(again)

    inbox.put(again)
    inbox.empty()
    inbox.empty()
    assert got == [0, 1]
    assert len(inbox) == 1


def test_inbox_accepts_commands_from_several_threads() -> None:
    inbox = Inbox()
    got: list[int] = []

    def flood() -> None:
        for _ in range(500):
            inbox.put(partial(got.append, 1))

    threads = [Thread(target=flood) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    inbox.empty()
    assert len(got) == 2000
