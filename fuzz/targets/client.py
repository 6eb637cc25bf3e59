"""Frames of a client at a served cell: they are answered or refused, and invalid ones have no effect."""

from __future__ import annotations

import socket
from collections.abc import Iterator
from functools import cache

from cellwright.cell.cell import Cell
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.conversions import joint_trajectory, trajectory_point
from cellwright.middleware.messages.osrf_gear import AGVControlRequest
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.middleware.server.clients import MAX_HELLO_BYTES, ClientConnection
from cellwright.middleware.server.requests import Requests
from cellwright.middleware.wire.frames import QUIET, Decoder, Frame, FrameError, FrameKind, advance, hello
from fuzz.verdict import FindingError

MAX_SIZE = 6000
WORDS = ("/clock", "/ariac/agv1", "/ariac/arm/command", "protocol", "encoding", "cdr", "ros1", "quiet", "\0\0\0\0")


@cache
def world() -> tuple[Cell, Requests]:
    """Return a cell and the handler of its clients' frames."""
    cell = Cell(load_trial([find_trial("lesson")]).trial, competition=False)
    return cell, Requests(cell, lockstep=True)


def seeds() -> Iterator[bytes]:
    """Yield dialogues as clients have them."""
    greeting = hello("/me", "cdr")
    way = joint_trajectory(["elbow_joint"], [trajectory_point([1.0], time_from_start=10**9)])
    for frames in (
        [greeting],
        [greeting, Frame(FrameKind.SUBSCRIBE, 1, "/clock"), Frame(FrameKind.UNSUBSCRIBE, 1)],
        [greeting, Frame(FrameKind.SUBSCRIBE, 1, "/ariac/orders", QUIET, "/gazebo"), advance(2, 10**9, each_tick=True)],
        [greeting, Frame(FrameKind.PUBLISH, 3, "/ariac/arm/command", payload=TYPES.to_cdr(way))],
        [greeting, Frame(FrameKind.CALL, 4, "/ariac/start_competition", payload=TYPES.to_cdr(TriggerRequest()))],
        [
            greeting,
            Frame(FrameKind.CALL, 4, "/ariac/agv1", node="/you", payload=TYPES.to_cdr(AGVControlRequest("kit"))),
        ],
    ):
        yield b"".join(frame.encode() for frame in frames)


def attempt(data: bytes) -> None:
    """Receive the bytes from a client, run a tick, and disconnect the client."""
    if _frames([data]) != _frames([data[:7], data[7:40], data[40:]]):
        raise FindingError("frames depend on how they come in pieces")
    cell, requests = world()
    with socket.create_server(("127.0.0.1", 0)) as listener:
        theirs = socket.create_connection(listener.getsockname())
        ours, _ = listener.accept()
    client = ClientConnection(ours, "127.0.0.1")
    try:
        for frame in Decoder(MAX_HELLO_BYTES).feed(data):
            requests.carry_out(client, frame)
        for _ in range(2):
            cell.step()
    except FrameError as error:
        if not str(error):
            raise FindingError("cut off without a reason") from None
    finally:
        requests.forget(client)
        said = bytes(client._out)
        client.close()
        theirs.close()
    for frame in Decoder().feed(said):
        if frame.kind is FrameKind.REFUSED and frame.text().startswith("the cell failed"):
            raise FindingError(frame.text())
    if requests.pending or any(info.subscribers.count("/me") for info in cell.bus.topics()):
        raise FindingError("a disconnected client left requests or subscriptions")


def _frames(pieces: list[bytes]) -> list[Frame]:
    """Return the frames in pieces of bytes, up to the first invalid one."""
    decoder, found = Decoder(MAX_HELLO_BYTES), list[Frame]()
    try:
        for piece in pieces:
            found.extend(decoder.feed(piece))
    except FrameError:
        pass
    return found
