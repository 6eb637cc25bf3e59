"""Subscribed topic of a relay: a message goes to the subscriptions of its moment, a latched one to later ones too."""

from __future__ import annotations

import threading

from cellwright.middleware.wire.graph import SubscribedTopic


class Topic(SubscribedTopic):
    """Topic whose publisher is the test."""

    is_connected = True

    def close(self) -> None:
        """Nothing is open."""


def topic() -> tuple[Topic, list[tuple[tuple[int, ...], bytes]]]:
    delivered: list[tuple[tuple[int, ...], bytes]] = []
    return Topic("/state", lambda *message: delivered.append(message)), delivered


def test_message_goes_to_the_subscriptions_of_its_moment() -> None:
    state, delivered = topic()
    state.take(b"a", 1, is_latched=False)
    state.add(7)
    state.take(b"b", 2, is_latched=False)
    state.add(8)
    state.take(b"c", 3, is_latched=False)
    assert state.remove(7)
    state.take(b"d", 4, is_latched=False)
    assert delivered == [((), b"a"), ((7,), b"b"), ((7, 8), b"c"), ((8,), b"d")]


def test_latched_message_comes_with_the_subscription() -> None:
    state, delivered = topic()
    state.take(b"a", 1, is_latched=True)
    state.add(7)
    state.add(8)
    assert delivered == [((), b"a"), ((7,), b"a"), ((8,), b"a")]


def test_topic_is_wanted_while_it_has_a_subscription() -> None:
    state, _ = topic()
    wanted = [state.is_wanted]
    state.add(7)
    assert not state.remove(8)
    wanted.append(state.is_wanted)
    assert state.remove(7)
    wanted.append(state.is_wanted)
    assert wanted == [False, True, False]


def test_wait_ends_with_the_awaited_message() -> None:
    state, _ = topic()
    assert not state.wait_for(1, 0.0)

    def send() -> None:
        for number in (1, 2):
            state.take(b"", number, is_latched=False)

    sender = threading.Thread(target=send)
    sender.start()
    assert state.wait_for(2, 60.0)
    sender.join()
