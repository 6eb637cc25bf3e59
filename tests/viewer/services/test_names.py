"""Names of the viewer services, by which a server tells viewers from agents."""

import os

import pytest

from cellwright.viewer.services.names import is_viewer
from cellwright.viewer.web.connection import ServerConnection


def test_page_and_its_frame_connection_are_viewers() -> None:
    page = ServerConnection(("127.0.0.1", 1))
    assert str(os.getpid()) in page.node
    assert is_viewer(page.node)
    assert is_viewer(page.sibling().node)


@pytest.mark.parametrize("node", ["", "/client", "/my/page_1"])
def test_agents_are_no_viewers(node: str) -> None:
    assert not is_viewer(node)
