"""Actions of the referee, from the log in the recording."""

from typing import Any

import pytest

from cellwright.middleware.messages.standard import Float32, String
from cellwright.recording.format.format import EVENT
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.cell import CompetitionReader
from cellwright.util.errors import MessageError
from tests.recording.plots.reading.recordings import event, kit, message, text

KIT: dict[str, Any] = {
    "kind": "kit",
    "tray_id": "agv1::x",
    "kit_type": "order_0_kit_0",
    "evidence": {"kit_type": "order_0_kit_0", "total": 1.0, "best": 6.0, "parts": [], "extras": []},
}
SCORE, STATE = "/ariac/current_score", "/ariac/competition_state"


def taken(*messages: RecordedMessage) -> CompetitionReader:
    competition = CompetitionReader()
    for each in messages:
        competition.take(each)
    return competition


def test_score_track_has_only_changes() -> None:
    scores = [(0.0, 0.0), (0.1, 0.0), (0.2, 3.0), (0.3, 3.0), (0.4, -1.0)]
    found = taken(*(message(t, Float32(data=p), SCORE) for t, p in scores)).score()
    assert found is not None
    assert (found.times.tolist(), found.points.tolist(), found.best) == ([0.0, 0.2, 0.4], [0.0, 3.0, -1.0], None)


def test_score_track_has_kits_of_log_that_no_sample_shows() -> None:
    found = taken(
        event(0.0, kind="run", reachable=8.0),
        message(0.0, Float32(data=0.0), SCORE),
        kit(0.05, total=2.0),
        message(0.1, Float32(data=2.0), SCORE),
        event(0.12, kind="kit", tray_id="agv1::x", kit_type="no_kit", refusal="unknown kit", evidence=None),
        kit(0.15, total=4.5),
        event(0.16, **{**KIT, "repeated": True}),
    ).score()
    assert found is not None
    assert (found.times.tolist(), found.points.tolist(), found.best) == ([0.0, 0.05, 0.15], [0.0, 2.0, 6.5], 8.0)


def test_score_track_from_checkpoint_begins_with_its_points_and_ends_with_result() -> None:
    found = taken(
        event(5.0, kind="run"),
        message(5.1, Float32(data=6.0), SCORE),
        kit(5.15, total=2.0),
        event(5.2, kind="result", outcome="done", score={"total": 9.0}),
    ).score()
    assert found is not None
    assert (found.times.tolist(), found.points.tolist()) == ([5.0, 5.15, 5.2], [6.0, 8.0, 9.0])


def test_states_of_log_are_shown_where_no_sample_is() -> None:
    competition = taken(
        message(0.0, String(data="init"), STATE),
        event(0.05, kind="state", state="go"),
        event(0.06, kind="state", state="done"),
    )
    assert [(span.label, span.begin) for span in competition.states.until(0.1)] == [
        ("init", 0.0),
        ("go", 0.05),
        ("done", 0.06),
    ]


def test_recording_without_score_has_no_track() -> None:
    assert taken(message(0.0, String(data="init"), STATE)).score() is None


def test_states_and_events_give_spans_and_marks() -> None:
    competition = taken(
        *(message(time, String(data=state), STATE) for time, state in enumerate(["init", "go", "go", "done"])),
        event(1.0, kind="order", order_id="order_0"),
        kit(2.0, agv=2, total=2.0, best=4.5),
        event(2.5, kind="kit", tray_id="agv1::x", kit_type="no_kit", refusal="unknown kit", evidence=None),
        event(3.0, kind="trial over", reason="time limit"),
        event(3.1, kind="result", outcome="done"),
        event(3.2, kind="a kind of later versions"),
    )
    assert [(span.label, span.end) for span in competition.states.until(4.0)] == [("init", 1), ("go", 3), ("done", 4)]
    assert [(mark.time, mark.label, mark.tray) for mark in competition.marks] == [
        (1.0, "order_0", ""),
        (2.0, "order_0_kit_0: 2 of 4.5", "AGV 2"),
        (2.5, "no_kit refused", "AGV 1"),
        (3.0, "time limit", ""),
    ]
    assert competition.result["outcome"] == "done"


def test_kit_event_gives_verdict_of_each_part() -> None:
    parts = [
        {"object": "bin7|piston_rod_part_1", "presence": 1.0},
        {"object": "gear_1", "presence": 0.0},
        {"object": None, "presence": 0.0},
    ]
    extras = [
        {"name": "gear_1", "type": "gear_part", "reason": "faulty"},
        {"name": "part3_1", "type": "part3", "reason": "wrong type"},
    ]
    competition = taken(kit(2.0, parts=parts, extras=extras))
    words = {"bin7|piston_rod_part_1": "right", "gear_1": "faulty", "part3_1": "not ordered"}
    assert competition.verdicts == [(2.0, "AGV 1", words)]


@pytest.mark.parametrize(
    "value",
    [
        {"kind": "kit"},
        {"kind": "order"},
        {"kind": "kit", "tray_id": "a", "evidence": 3},
        {**KIT, "evidence": {**KIT["evidence"], "total": float("nan")}},
        {**KIT, "evidence": {**KIT["evidence"], "total": "1"}},
        {**KIT, "evidence": {**KIT["evidence"], "total": 10**400}},
        {**KIT, "time": 10**400},
        {"kind": "run", "reachable": float("inf")},
        {"kind": "result", "score": {"total": None}},
        [1],
        "no object",
    ],
)
def test_incomplete_log_line_is_refused(value: object) -> None:
    with pytest.raises(MessageError):
        taken(text(0.0, EVENT, value))


def test_collisions_of_log_have_times_and_names() -> None:
    facts = {
        "owner": "arm",
        "link": "wrist_2_link",
        "obstacle": "camera frame 2",
        "begin": 0.1,
        "end": 0.4,
        "deviation": 0.2,
    }
    (found,) = taken(event(0.4, kind="collision", **facts)).collisions
    assert (found.begin, found.end, found.label, found.owner) == (0.1, 0.4, "wrist 2 / camera frame 2", "arm")
    with pytest.raises(MessageError):
        taken(event(0.4, kind="collision", **{**facts, "begin": "soon"}))
