"""Page of a cell with a robot: it shows the robot's links beside the cell, and how they move."""

from contextlib import closing
from pathlib import Path

import pytest

from cellwright import Client
from cellwright.middleware.messages.conversions import joint_state
from tests.browser.conftest import Visit
from tests.browser.seen import Hues, middle, share
from tests.browser.serving import viewed
from tests.cell.robot_cells import AT_BIN

pytestmark = pytest.mark.browser

ORANGE = Hues(22.0, 10.0, saturation=0.6)
"""Colour of the robot's upper arms and fingers."""


def test_page_shows_the_robot_and_its_motion(tmp_path: Path, visit: Visit) -> None:
    (tmp_path / "cell.yaml").write_text(AT_BIN)
    with viewed(tmp_path, "serve", "cell.yaml", "-d", "--port", "0") as cell:
        visitor = visit(cell.url)
        visitor.read("^running$")
        before = visitor.scene()
        assert share(before, ORANGE) > 1e-3
        host, port = cell.address
        with closing(Client.connect(f"{host}:{port}")) as client:
            states = client.latest("/left/joint_states")
            client.wait_until(lambda: states.message is not None)
            client.publish("/left/joint_cmd", joint_state(["lift"], [0.3], time=0))
            client.wait_until(lambda: states.message.position[states.message.name.index("lift")] > 0.29)
        visitor.change(before)
        visitor.wait(lambda: middle(visitor.scene(), ORANGE)[1] != middle(before, ORANGE)[1], "arms that are raised")
        assert share(visitor.scene(), ORANGE) > 1e-3
