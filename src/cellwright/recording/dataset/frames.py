"""Frames of a recorded run: the run is repeated from its commands, and stands at the begin of each frame."""

from collections.abc import Generator
from fractions import Fraction

from cellwright.engine.clock import seconds
from cellwright.recording.format.commands import Command
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.verify import HashPoint, recorded_steps
from cellwright.rendering.scene.engine import DrawnNode
from cellwright.util.errors import RecordingError, UsageError

_MAX_RATE = 1000  # [Hz]


def frame_instants(recording: RecordingFile, hz: int) -> Generator[DrawnNode, None, None]:
    """Repeat the recorded run; yield the cell or the robot's node at the begin of each frame, and at the last end.

    An instant comes before the commands of its tick, which belong to the frame that begins there. The last frame is the
    one in which the run ends; its rest passes without commands. Close the generator, or exhaust it.

    Args:
        recording: a complete recording.
        hz: frames in a second [Hz].

    Raises:
        RecordingError: the recording ends before its run did, cannot be run again, or its run differs here.
        UsageError: a frame would be no whole number of ticks.
        SimulationError: the state has become unstable.
    """
    if recording.end is None:
        raise RecordingError(f"{recording.path}: ends before its run did; record the run again")
    with rebuild(recording) as rebuilt:
        served = rebuilt.served
        simulation, clock = served.simulation, served.simulation.clock
        ticks = frame_ticks(hz, clock.timestep)
        due = clock.tick
        for step in recorded_steps(recording):
            tick = step.tick if isinstance(step, Command | HashPoint) else clock.first_tick_at(step.time)
            while due <= tick:
                simulation.step_until(clock.time_of(due))
                yield served
                due += ticks
            simulation.step_until(clock.time_of(tick))
            if isinstance(step, Command):
                rebuilt.carry_out(step)
            elif isinstance(step, HashPoint) and simulation.state_hash() != step.hash:
                raise RecordingError(
                    f"{recording.path}: the run differs here at {seconds(simulation.now):.3f} s, so its values are not "
                    f"those that were recorded; see cellwright replay {recording.path.name} --verify"
                )
        if clock.tick > due - ticks:
            simulation.step_until(clock.time_of(due))
            yield served


def frame_ticks(hz: int, timestep: Fraction) -> int:
    """Return the length of a frame in ticks.

    Args:
        hz: frames in a second [Hz]; data sets have a whole number.
        timestep: length of a tick [s].

    Raises:
        UsageError: it would be no whole number.

    Example:
        >>> frame_ticks(20, Fraction(1, 500)), frame_ticks(30, Fraction(1, 240))
        (25, 8)
        >>> frame_ticks(30, Fraction(1, 500))
        Traceback (most recent call last):
        cellwright.util.errors.UsageError: hz: a frame must be whole ticks of 2 ms (got 30 Hz); take 25 or 50
    """

    def fits(wanted: int) -> bool:
        return (1 / (wanted * timestep)).denominator == 1

    if not 0 < hz <= _MAX_RATE:
        raise UsageError(f"hz: must be from 1 to {_MAX_RATE} Hz (got {hz:g})")
    if hz != int(hz) or not fits(int(hz)):
        below = next(filter(fits, range(int(hz), 0, -1)), None)
        above = next(filter(fits, range(int(hz) + 1, _MAX_RATE + 1)), None)
        near = " or ".join(str(each) for each in (below, above) if each is not None)
        raise UsageError(
            f"hz: a frame must be whole ticks of {float(timestep) * 1000:g} ms (got {hz:g} Hz); "
            f"{f'take {near}' if near else 'no whole rate suits it'}"
        )
    return int(1 / (int(hz) * timestep))
