import json

import pytest
from hypothesis import given

from cellwright.cell.kitting.inventory import TrayContents, Trays, contents_from_json, contents_to_json
from cellwright.util.errors import UnknownNameError
from tests.cell.kitting.builders import TRAY_1, TRAY_2, contents, thing


def test_a_tray_is_known_from_its_first_report_on() -> None:
    trays = Trays()
    with pytest.raises(UnknownNameError, match="known: none"):
        trays.contents(TRAY_1)
    trays.report(TRAY_1, [])
    assert trays.contents(TRAY_1) == ()
    with pytest.raises(UnknownNameError, match=TRAY_1):
        trays.contents(TRAY_2)


def test_the_last_report_counts() -> None:
    trays = Trays()
    trays.report(TRAY_1, [thing(), thing("disk_part")])
    trays.report(TRAY_2, [thing("pulley_part")])
    trays.report(TRAY_1, [thing("disk_part")])
    assert trays.contents(TRAY_1) == (thing("disk_part"),)
    assert trays.all_contents() == ((thing("disk_part"),), (thing("pulley_part"),))


@pytest.mark.slow
@given(contents())
def test_contents_go_through_json(things: TrayContents) -> None:
    assert contents_from_json(json.loads(json.dumps(contents_to_json(things)))) == things


def test_state_goes_through_json() -> None:
    trays, other = Trays(), Trays()
    trays.report(TRAY_1, [thing(x=0.1, yaw=0.3, faulty=True)])
    other.report(TRAY_2, [thing()])
    other.set_state(json.loads(json.dumps(trays.get_state())))
    assert other.contents(TRAY_1) == trays.contents(TRAY_1)
    with pytest.raises(UnknownNameError):
        other.contents(TRAY_2)
