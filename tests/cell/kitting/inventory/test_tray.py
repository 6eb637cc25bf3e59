import json

import pytest
from hypothesis import given

from cellwright.cell.kitting.inventory import TrayContents, contents_from_json, contents_to_json
from tests.cell.kitting.builders import contents


@pytest.mark.slow
@given(contents())
def test_tray_contents_survive_json(tray_objects: TrayContents) -> None:
    assert contents_from_json(json.loads(json.dumps(contents_to_json(tray_objects)))) == tray_objects
