"""Controls that may be used now and again, on a real panel of viser's."""

from collections.abc import Iterator

import pytest
import viser

from cellwright.viewer.web.panels.allowed import allow
from tests.ros1.ports import free_port


@pytest.fixture(scope="module")
def gui() -> Iterator[viser.GuiApi]:
    server = viser.ViserServer(host="127.0.0.1", port=free_port(), verbose=False)
    yield server.gui
    server.stop()


def test_what_can_be_greyed_out_is(gui: viser.GuiApi) -> None:
    slider = gui.add_slider("belt", min=0.0, max=1.0, step=0.1, initial_value=0.0)
    for reason in ("in a competition", "in a competition", "", ""):
        allow(slider, reason)
        assert (slider.disabled, slider.visible) == (bool(reason), True)


def test_a_group_of_buttons_goes_and_comes_back(gui: viser.GuiApi) -> None:
    group = gui.add_button_group("send", ("AGV 1", "AGV 2"))
    for reason in ("in a competition", "in a competition", "", ""):
        allow(group, reason)
        assert group.visible == (not reason)
