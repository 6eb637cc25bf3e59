from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from cellwright.engine.loop import SimulationLoop, StopCondition
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.server import Server
from cellwright.recording.replay.playback import AtEnd, Playing, Recorded
from tests.recording.replay.memory import SECOND, recording


@pytest.fixture
def recorded() -> Recorded:
    return Recorded(recording(2))


@pytest.fixture
def server(recorded: Recorded) -> Iterator[Server]:
    server = Server(recorded, port=0)
    yield server
    server.close("the test is over")


def loop_of(playing: Playing, server: Server, **more: Any) -> SimulationLoop:
    stop = StopCondition(playing.last)
    return SimulationLoop(playing.recorded.simulation, server, rate=playing.rate, stop=stop, **more)


def play(playing: Playing, server: Server) -> None:
    playing.run(loop_of(playing, server))


def test_playback_stops_at_end(recorded: Recorded, server: Server) -> None:
    play(Playing(recorded, RateControl()), server)

    assert recorded.simulation.now == 2 * SECOND


def test_playback_of_time_range_plays_only_that_range(recorded: Recorded, server: Server) -> None:
    times: list[int] = []
    recorded.bus.subscribe("/clock", lambda message: times.append(message.clock.sec * SECOND + message.clock.nanosec))

    play(Playing(recorded, RateControl(), first=SECOND // 2, last=SECOND), server)

    assert times == list(range(SECOND // 2 + SECOND // 50, SECOND + 1, SECOND // 50))


def test_times_outside_recording_are_clamped(recorded: Recorded) -> None:
    playing = Playing(recorded, RateControl(), first=-SECOND, last=99 * SECOND)

    assert (playing.first, playing.last) == (0, 2 * SECOND)


def test_playback_in_loop_restarts_at_end(recorded: Recorded, server: Server) -> None:
    begun = 0

    def count(message: object) -> None:
        nonlocal begun
        begun += 1
        if begun == 220:  # more than two rounds of 100
            loop.stop.request()

    recorded.bus.subscribe("/clock", count)
    playing = Playing(recorded, RateControl(), at_end=AtEnd.LOOP)
    loop = loop_of(playing, server)
    playing.run(loop)

    assert begun == 220
    assert recorded.simulation.now == SECOND * 20 // 50


def test_playback_with_hold_waits_at_end_until_seek(recorded: Recorded, server: Server) -> None:
    tempo = RateControl()
    polls = 0
    seen: list[int] = []

    def poll() -> None:
        nonlocal polls
        if not tempo.is_paused:
            return
        polls += 1
        seen.append(recorded.simulation.now)
        if polls == 1:
            tempo.step()
        elif polls == 3:
            playing.seek(SECOND)
        elif polls == 5 or polls == 7:
            playing.resume()
        elif polls == 9:
            loop.stop.request()

    playing = Playing(recorded, tempo, at_end=AtEnd.HOLD)
    loop = loop_of(playing, server, on_poll=poll)
    playing.run(loop)

    assert seen[0] == seen[2] == 2 * SECOND, "a step at the end leads nowhere"
    assert seen[3:5] == [SECOND, SECOND]
    assert seen[5] == seen[8] == 2 * SECOND, "resumed in the middle, and at the end from the start"
