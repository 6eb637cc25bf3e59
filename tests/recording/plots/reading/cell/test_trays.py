"""Parts on the trays, from the panel."""

import pytest

from cellwright.recording.format.format import PANEL
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.cell import Trays
from cellwright.util.errors import MessageError
from tests.recording.plots.reading.recordings import text, trays

ROD, GEAR = "bin7|piston_rod_part_9", "populate_conveyor|gear_part_clone_2"


def taken(*messages: RecordedMessage) -> Trays:
    found = Trays()
    for each in messages:
        found.take(each)
    return found


def test_part_on_tray_has_begin_and_end() -> None:
    found = taken(
        trays(0.0, agv1=[], agv2=[]),
        trays(2.0, agv1=[ROD], agv2=[]),
        trays(4.0, agv1=[ROD, GEAR], agv2=[]),
        trays(6.0, agv1=[GEAR], agv2=[ROD]),
    )
    assert found.names == ["AGV 1", "AGV 2"]
    assert [(part.tray, part.name, part.begin, part.end) for part in found.parts(9.0, [])] == [
        ("AGV 1", "piston rod 9 (bin7)", 2.0, 6.0),
        ("AGV 1", "gear 2 (belt)", 4.0, 9.0),
        ("AGV 2", "piston rod 9 (bin7)", 6.0, 9.0),
    ]


def test_verdict_applies_to_part_on_tray_at_that_time() -> None:
    found = taken(trays(0.0, agv1=[ROD]), trays(5.0, agv1=[]), trays(20.0, agv1=[ROD]))
    parts = found.parts(30.0, [(5.5, "AGV 1", {ROD: "right"}), (5.5, "AGV 2", {ROD: "faulty"})])
    assert [part.verdict for part in parts] == ["right", ""]


def test_faulty_part_has_verdict_before_submission() -> None:
    found = taken(trays(0.0, agv1=["!" + ROD, GEAR]))
    assert [part.verdict for part in found.parts(1.0, [])] == ["faulty", ""] or [
        part.verdict for part in found.parts(1.0, [])
    ] == ["", "faulty"]
    assert {part.name: part.verdict for part in found.parts(1.0, [])}["piston rod 9 (bin7)"] == "faulty"


@pytest.mark.parametrize(
    "panel", [{"trays": [{"parts": []}]}, {"trays": [3]}, {"trays": [{"number": 1}]}, {"trays": 3}]
)
def test_incomplete_panel_is_refused(panel: object) -> None:
    with pytest.raises(MessageError):
        taken(text(0.0, PANEL, panel))
