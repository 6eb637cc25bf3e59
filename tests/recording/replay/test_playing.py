from __future__ import annotations

from collections.abc import Iterator

import pytest

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


def test_it_stops_at_the_end(recorded: Recorded, server: Server) -> None:
    Playing(recorded, server, tempo=RateControl()).run()

    assert recorded.simulation.now == 2 * SECOND


def test_a_part_of_it_is_played(recorded: Recorded, server: Server) -> None:
    times: list[int] = []
    recorded.bus.subscribe("/clock", lambda message: times.append(message.clock.sec * SECOND + message.clock.nanosec))

    Playing(recorded, server, tempo=RateControl(), first=SECOND // 2, last=SECOND).run()

    assert times == list(range(SECOND // 2 + SECOND // 50, SECOND + 1, SECOND // 50))


def test_times_past_the_recording_are_kept_within_it(recorded: Recorded, server: Server) -> None:
    playing = Playing(recorded, server, tempo=RateControl(), first=-SECOND, last=99 * SECOND)

    assert (playing.first, playing.last) == (0, 2 * SECOND)


def test_in_a_loop_it_begins_again(recorded: Recorded, server: Server) -> None:
    begun = 0

    def count(message: object) -> None:
        nonlocal begun
        begun += 1
        if begun == 220:  # more than two rounds of 100
            playing.stop()

    recorded.bus.subscribe("/clock", count)
    playing = Playing(recorded, server, tempo=RateControl(), at_end=AtEnd.LOOP)
    playing.run()

    assert begun == 220
    assert recorded.simulation.now == SECOND * 20 // 50


def test_at_its_end_it_holds_until_somebody_looks_elsewhere(recorded: Recorded, server: Server) -> None:
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
            playing.stop()

    playing = Playing(recorded, server, tempo=tempo, at_end=AtEnd.HOLD, on_poll=poll)
    playing.run()

    assert seen[0] == seen[2] == 2 * SECOND, "a step at the end leads nowhere"
    assert seen[3:5] == [SECOND, SECOND]
    assert seen[5] == seen[8] == 2 * SECOND, "resumed in the middle, and at the end from the start"
