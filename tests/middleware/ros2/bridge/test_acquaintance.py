"""Acquaintance of nodes with a publisher: each has answered, or is not awaited any more."""

from __future__ import annotations

from cellwright.middleware.ros2.bridge.acquaintance import PATIENCE, Acquaintance


class Answer:
    """Future of a call."""

    def __init__(self) -> None:
        self.is_done = False

    def done(self) -> bool:
        return self.is_done


class Client:
    """Client of a node's service."""

    def __init__(self, *, is_ready: bool = True) -> None:
        self.is_ready = is_ready
        self.answers: list[Answer] = []

    def service_is_ready(self) -> bool:
        return self.is_ready

    def call_async(self, request: object) -> Answer:
        assert request == "nothing"
        self.answers.append(Answer())
        return self.answers[-1]


class Clock:
    """Time [s] that the test sets."""

    now = 100.0

    def __call__(self) -> float:
        return self.now


def test_acquaintance_is_made_once_all_nodes_have_answered() -> None:
    one, other, destroyed, clock = Client(), Client(is_ready=False), list[object](), Clock()
    acquaintance = Acquaintance([one, other], "nothing", destroyed.append, clock)
    assert not acquaintance.is_made()
    one.answers[0].is_done = True
    assert not acquaintance.is_made()
    assert destroyed == [one]
    other.is_ready = True
    clock.now += 0.5
    assert not acquaintance.is_made()
    other.answers[0].is_done = True
    assert acquaintance.is_made()
    assert acquaintance.is_made()
    assert destroyed == [one, other]


def test_lost_request_is_sent_again_and_any_answer_counts() -> None:
    client, clock = Client(), Clock()
    acquaintance = Acquaintance([client], "nothing", lambda _: None, clock)
    for _ in range(10):
        assert not acquaintance.is_made()
        clock.now += 0.05
    assert 2 <= len(client.answers) <= 4
    client.answers[-1].is_done = True
    assert acquaintance.is_made()


def test_node_that_does_not_answer_is_awaited_for_a_limited_time() -> None:
    client, destroyed, clock = Client(), list[object](), Clock()
    acquaintance = Acquaintance([client], "nothing", destroyed.append, clock)
    assert not acquaintance.is_made()
    clock.now += PATIENCE
    assert acquaintance.is_made()
    assert destroyed == [client]


def test_acquaintance_without_nodes_is_made() -> None:
    assert Acquaintance([], "nothing", lambda _: None).is_made()
