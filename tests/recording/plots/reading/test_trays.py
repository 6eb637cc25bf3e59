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


def test_a_part_lies_there_from_when_until_when() -> None:
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


def test_a_verdict_is_for_what_lay_there_then() -> None:
    found = taken(trays(0.0, agv1=[ROD]), trays(5.0, agv1=[]), trays(20.0, agv1=[ROD]))
    parts = found.parts(30.0, [(5.5, "AGV 1", {ROD: "right"}), (5.5, "AGV 2", {ROD: "faulty"})])
    assert [part.verdict for part in parts] == ["right", ""]


def test_what_is_known_to_be_faulty_is_so_before_it_is_judged() -> None:
    found = taken(trays(0.0, agv1=["!" + ROD, GEAR]))
    assert [part.verdict for part in found.parts(1.0, [])] == ["faulty", ""] or [
        part.verdict for part in found.parts(1.0, [])
    ] == ["", "faulty"]
    assert {part.name: part.verdict for part in found.parts(1.0, [])}["piston rod 9 (bin7)"] == "faulty"


@pytest.mark.parametrize(
    "panel", [{"trays": [{"parts": []}]}, {"trays": [3]}, {"trays": [{"number": 1}]}, {"trays": 3}]
)
def test_a_panel_that_lacks_something_is_left_out(panel: object) -> None:
    with pytest.raises(MessageError):
        taken(text(0.0, PANEL, panel))
