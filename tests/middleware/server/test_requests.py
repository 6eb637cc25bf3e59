"""Requests: one encoding of a message for all clients, and the description of a bus for HELLO."""

from __future__ import annotations

import pytest

from cellwright.middleware.bus import Bus
from cellwright.middleware.messages import TYPES, Message
from cellwright.middleware.messages.standard import MarkerArray, String
from cellwright.middleware.messages.types import Encoding, TypeSet
from cellwright.middleware.server.requests import MessageEncoder, describe_interface


def test_message_is_written_once_in_each_encoding(monkeypatch: pytest.MonkeyPatch) -> None:
    written: list[str] = []

    def counted(name: str, encoding: Encoding) -> Encoding:
        def write(message: Message) -> bytes:
            written.append(name)
            return encoding.write(message)

        return Encoding(write, encoding.read)

    types: TypeSet = TYPES
    monkeypatch.setattr(types, "encodings", {name: counted(name, each) for name, each in types.encodings.items()})
    encoder, first, second = MessageEncoder(types), String("a"), String("b")
    for message in (first, second):
        for encoding in ("cdr", "ros1", "cdr", "ros1"):
            assert encoder.to_bytes(message, encoding) == types.encodings[encoding].write(message)
    written_by_test = 8
    assert len(written) == 4 + written_by_test


def test_interface_has_checksums_and_none_without_form_in_ros1() -> None:
    bus = Bus(lambda: 0)
    bus.advertise("/words", "std_msgs/String", rate="5 Hz", node="/me", latch=True)
    bus.advertise("/markers", "visualization_msgs/MarkerArray", node="/me").publish(MarkerArray([]))
    markers, words = describe_interface(bus)["topics"]
    assert (words["md5"], words["publishers"], words["latch"]) == (TYPES.md5("std_msgs/String"), ("/me",), True)
    assert (markers["name"], markers["md5"], markers["definition"]) == ("/markers", "", "")
