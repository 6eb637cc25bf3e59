"""Assertions on a recorded run: signals, held parts, cycles, distances, contacts and speeds."""

from __future__ import annotations

from collections.abc import Iterator
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import cellwright
from cellwright.cell.cell import Cell
from cellwright.recording.opened import Recording
from cellwright.recording.replay.distances import TOUCHING
from cellwright.util.errors import RecordingError, UnknownNameError

pytestmark = pytest.mark.slow
LINKS = ["upper_arm_link", "forearm_link", "wrist_*_link"]
FIRST = "bin7|piston_rod_part_5"


FRAMES = [Fraction(number, 25) for number in range(1, 13 * 25)]
"""Simulation times of the frames [s]."""


class EngineContacts:
    """Pairs of bodies that touch in the engine, by simulation time [s]; those of sleeping bodies are missing."""

    def __init__(self) -> None:
        self.pairs: dict[float, set[frozenset[str]]] = {}

    def look(self, cell: Cell) -> None:
        data, model = cell.simulation.data, cell.simulation.model
        parts = {body: part.name for body, part in cell.parts.by_body.items()}
        geoms = data.contact.geom[data.contact.dist < TOUCHING]
        names = [
            [parts.get(int(body)) or model.body(body).name or "floor" for body in pair]
            for pair in model.geom_bodyid[geoms]
        ]
        self.pairs[cell.simulation.time] = {frozenset(pair) for pair in names}


@pytest.fixture(scope="module")
def engine() -> EngineContacts:
    return EngineContacts()


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory, engine: EngineContacts) -> Path:
    path = tmp_path_factory.mktemp("asserted") / "run.mcap"
    options = cellwright.RunOptions(until=13.0, at=[(time, engine.look) for time in FRAMES])
    cellwright.run_trial("lesson", "lesson", record=path, options=options)
    return path


@pytest.fixture
def run(path: Path) -> Iterator[Recording]:
    with cellwright.open_recording(path) as opened:
        yield opened


def test_spans_of_boolean_field_are_those_of_its_messages(run: Recording) -> None:
    spans = run.spans("gripper attached")

    states = [(each.time, each.message.attached) for each in run.messages("/ariac/gripper/state")]
    changes = [time for (_, before), (time, now) in pairwise(states) if before != now]
    assert [time for span in spans for time in (span.begin, span.end)] == pytest.approx(changes)
    assert run.span("gripper attached", -1) == spans[-1]
    assert run.cycle_times().tolist() == pytest.approx([spans[1].begin - spans[0].begin])
    assert all(span.duration == span.end - span.begin > 1.0 for span in spans)


def test_texts_are_signals_with_underscores_or_spaces(run: Recording) -> None:
    assert run.spans("agv1 ready_to_deliver") == run.spans("agv1 ready to deliver")
    assert run.span("agv1 ready to deliver").end == run.end
    assert {"competition go", "gripper enabled"} < set(run.signals)
    assert "agv1 delivering" not in run.signals


def test_held_parts_are_those_that_rise_with_the_gripper(run: Recording) -> None:
    held = run.held_parts()

    assert [(span.begin, span.end) for span in held] == [
        (span.begin, span.end) for span in run.spans("gripper attached")
    ]
    assert held[0].label == FIRST
    for span in held:
        _, pose = run.path(span.label, start=span.begin, until=span.end)
        assert pose[:, 2].max() - pose[0, 2] > 0.1


def test_contact_of_gripper_and_part_covers_its_period(run: Recording) -> None:
    span, frame = run.span("gripper attached"), 0.04
    contact = next(each for each in run.contacts("vacuum_gripper_link") if each.other == FIRST)
    assert contact.begin <= span.begin + frame
    assert contact.end == pytest.approx(span.end, abs=frame)
    during = run.contacts("vacuum_gripper_link", start=span.end + 2 * frame, until=span.end + 1.0)
    assert during == ()


def test_contacts_of_the_engine_are_among_those_of_the_frames(run: Recording, engine: EngineContacts) -> None:
    contacts = run.contacts("*", "*")
    found = {(pair, time) for time, pairs in engine.pairs.items() for pair in pairs}
    assert len(found) > 100
    assert {pair for pair, _ in found} >= {frozenset({FIRST, "vacuum_gripper_link"}), frozenset({FIRST, "bin7"})}
    for pair, time in found:
        spans = [(each.begin, each.end) for each in contacts if {each.one, each.other} == pair]
        assert any(begin - 1e-9 <= time <= end + 1e-9 for begin, end in spans), (pair, time)


def test_robot_is_measured_by_its_seen_shapes(tmp_path: Path) -> None:
    with cellwright.Session("tandem", record=tmp_path / "robot.mcap") as session:
        session.run(until=0.3)
    with cellwright.open_recording(tmp_path / "robot.mcap") as robot:
        assert 0.0 <= robot.clearance("*", "floor").distance < 0.1
        assert robot.spans("io_teleop status enabled")[0].begin < 0.3
        with pytest.raises(UnknownNameError, match="unknown signal 'gripper attached'"):
            robot.held_parts()


def test_part_at_rest_touches_its_bin_and_no_part_the_floor(run: Recording) -> None:
    (contact,) = run.contacts("bin7|piston_rod_part_1")
    assert (contact.other, contact.end) == ("bin7", run.end)
    assert run.contacts("*|*", "floor") == ()


def test_clearance_is_that_of_the_frame_that_it_names(run: Recording) -> None:
    least = run.clearance(LINKS, "bin?")
    assert 0.0 < least.distance < 0.1
    there = run.clearance(least.one, least.other, start=least.time - 0.001, until=least.time + 0.001)
    assert there.distance == pytest.approx(least.distance)
    before = run.clearance(LINKS, "bin?", until=least.time)
    assert before.distance > least.distance


def test_speed_is_zero_at_rest_and_that_of_the_path_in_motion(run: Recording) -> None:
    span = run.span("gripper attached")
    _, still = run.speed("bin7|piston_rod_part_1", start=2.0)
    assert still.max() < 1e-3
    time, speed = run.speed(FIRST, start=span.begin, until=span.end)
    _, pose = run.path(FIRST, start=span.begin, until=span.end)
    assert (speed * 0.04).sum() == pytest.approx(np.linalg.norm(np.diff(pose[:, :3], axis=0), axis=1).sum())
    assert span.begin < time[0] < time[-1] < span.end


def test_part_out_of_play_has_no_speed(run: Recording) -> None:
    clone = "populate_conveyor|gear_part_clone_19"
    assert [array.shape for array in run.speed(clone)] == [(0,), (0,)]
    with pytest.raises(RecordingError, match="no frame shows both"):
        run.clearance(clone)


@pytest.mark.parametrize(
    ("ask", "text"),
    [
        (lambda run: run.spans("griper attached"), "did you mean gripper attached"),
        (lambda run: run.contacts("bin9"), "unknown body 'bin9'; did you mean bin"),
        (lambda run: run.speed("forearm"), "did you mean forearm_link"),
    ],
)
def test_unknown_name_is_refused_with_suggestion(run: Recording, ask: object, text: str) -> None:
    with pytest.raises(UnknownNameError, match=text):
        ask(run)  # type: ignore[operator]


def test_times_without_a_frame_are_refused(run: Recording) -> None:
    for ask in (run.contacts, run.clearance):
        with pytest.raises(RecordingError, match=r"no frame in these times \(got start 20.0, until None\)"):
            ask("*|*", "floor", start=20.0)


def test_period_that_is_not_there_is_refused(run: Recording) -> None:
    with pytest.raises(RecordingError, match=r"gripper attached has no period 7 \(got 2 periods\)"):
        run.span("gripper attached", 7)
