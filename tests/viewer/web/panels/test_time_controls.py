"""How time passes, at the top of the panel: over a real viser, which refuses what it cannot do."""

from __future__ import annotations

from collections.abc import Iterator
from types import SimpleNamespace
from typing import Any

import pytest
import viser

from cellwright.viewer.web.panels.time_controls import TimeControls


@pytest.fixture
def page() -> Iterator[Any]:
    server = viser.ViserServer("127.0.0.1", 0, verbose=False)
    yield SimpleNamespace(server=server, link=SimpleNamespace(welcome={}), scene=None)
    server.stop()


def panel(**refused: str) -> dict[str, Any]:
    control = {"paused": False, "ticks_left": 0, "speed": 1.0, "lockstep": False, "resets": 0, "refused": refused}
    return {"kind": "robot", "time": 1_000_000_000, "control": control}


def test_what_may_not_be_done_is_not_offered(page: Any) -> None:
    controls = TimeControls()
    controls.begin(page, None)  # type: ignore[arg-type]
    controls.panel(panel(pause="a real robot's time passes", speed="a real robot's time passes"))
    assert not controls._steps.visible
    assert not controls._speeds.visible
    controls.panel(panel())
    assert controls._steps.visible
    assert controls._speeds.visible
