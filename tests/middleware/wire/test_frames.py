from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.wire.frames import (
    MAX_FRAME_BYTES,
    Decoder,
    Frame,
    FrameError,
    FrameKind,
    advance,
    data_frame,
    hello,
    read_advance,
    read_time,
    time_frame,
)

names = st.text(max_size=20)
frames = st.builds(
    Frame,
    kind=st.sampled_from(FrameKind),
    number=st.integers(0, 2**32 - 1),
    name=names,
    type=names,
    node=names,
    payload=st.binary(max_size=200),
)


@pytest.mark.slow
@given(st.lists(frames, max_size=5), st.integers(1, 50))
def test_decoder_restores_frames_from_any_pieces(said: list[Frame], size: int) -> None:
    data = b"".join(frame.encode() for frame in said)
    decoder = Decoder()
    heard = [frame for at in range(0, len(data), size) for frame in decoder.feed(data[at : at + size])]
    assert heard == said


@pytest.mark.slow
@given(st.binary(max_size=300))
def test_decoder_with_random_bytes_raises_frame_error_only(data: bytes) -> None:
    decoder = Decoder()
    try:
        for frame in decoder.feed(data):
            assert isinstance(frame.kind, FrameKind)
    except FrameError:
        pass


def test_decoder_yields_frames_before_invalid_bytes() -> None:
    feed = Decoder().feed(Frame(FrameKind.DONE, 7).encode() + struct.pack("<I", 3) + b"abc")
    assert next(feed) == Frame(FrameKind.DONE, 7)
    with pytest.raises(FrameError, match="3 bytes"):
        next(feed)


@pytest.mark.parametrize(
    ("data", "reason"),
    [
        (struct.pack("<I", MAX_FRAME_BYTES + 1), "invalid frame length"),
        (struct.pack("<IBIHHH", 11, FrameKind.CALL, 1, 5, 0, 0), "longer than the frame"),
        (struct.pack("<IBIHHH", 11, 200, 1, 0, 0, 0), "200"),
        (struct.pack("<IBIHHH", 12, FrameKind.CALL, 1, 1, 0, 0) + b"\xff", "invalid frame"),
    ],
)
def test_invalid_frame_is_refused_with_reason(data: bytes, reason: str) -> None:
    with pytest.raises(FrameError, match=reason):
        list(Decoder().feed(data))


@pytest.mark.parametrize("frame", [Frame(FrameKind.CALL, -1), Frame(FrameKind.CALL, name="x" * 70_000)])
def test_frame_with_number_or_name_out_of_range_is_refused(frame: Frame) -> None:
    with pytest.raises(FrameError, match="cannot encode"):
        frame.encode()


def test_frame_that_is_too_long_is_refused() -> None:
    with pytest.raises(FrameError, match="too long"):
        Frame(FrameKind.MESSAGE, payload=bytes(MAX_FRAME_BYTES)).encode()


def test_hello_has_protocol_node_encoding_and_key() -> None:
    assert hello("/me", "ros1").json() == {"protocol": 1, "node": "/me", "encoding": "ros1"}
    assert hello("/me", "cdr", "abc").json() == {"protocol": 1, "node": "/me", "encoding": "cdr", "key": "abc"}


@pytest.mark.parametrize("payload", [b"", b"[]", b"\xff", b"[" * 100_000])
def test_payload_that_is_no_json_object_is_refused(payload: bytes) -> None:
    with pytest.raises(FrameError, match="not a JSON object"):
        Frame(FrameKind.HELLO, payload=payload).json()


def test_invalid_utf8_text_is_read_with_replacements() -> None:
    assert Frame(FrameKind.ENDED, payload=b"so\xff").text() == "so\ufffd"


@given(st.integers(-(2**63), 2**63 - 1), st.booleans())
def test_time_round_trip_keeps_nanoseconds(time: int, each_tick: bool) -> None:
    assert read_advance(advance(3, time, each_tick=each_tick)) == (time, each_tick)
    assert read_time(time_frame(3, time)) == time


@pytest.mark.parametrize("read", [read_advance, read_time])
def test_time_payload_of_wrong_length_is_refused(read: object) -> None:
    with pytest.raises(FrameError, match="invalid payload"):
        read(Frame(FrameKind.TIME, payload=b"abc"))  # type: ignore[operator]


@given(st.dictionaries(names, st.integers() | names), st.binary(max_size=200))
def test_data_frame_holds_json_and_bytes(said: dict[str, object], data: bytes) -> None:
    [frame] = Decoder().feed(data_frame(7, said, data).encode())
    assert (frame.kind, frame.number) == (FrameKind.DATA, 7)
    found, rest = frame.data()
    assert (found, bytes(rest)) == (said, data)


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (b"", "longer than its payload"),
        (b"\0\0\0", "longer than its payload"),
        (struct.pack("<I", 3) + b"{}", "longer than its payload"),
        (struct.pack("<I", 2**32 - 1) + b"{}", "longer than its payload"),
        (struct.pack("<I", 0) + b"{}", "not a JSON object"),
        (struct.pack("<I", 1) + b"{}", "not a JSON object"),
        (struct.pack("<I", 2) + b"[]", "not a JSON object"),
    ],
)
def test_data_frame_with_wrong_length_or_json_is_refused(payload: bytes, reason: str) -> None:
    with pytest.raises(FrameError, match=reason):
        Frame(FrameKind.DATA, payload=payload).data()


def test_data_of_other_frame_kind_is_refused() -> None:
    with pytest.raises(FrameError, match=r"expected DATA \(got ANSWER\)"):
        Frame(FrameKind.ANSWER, payload=struct.pack("<I", 2) + b"{}").data()
