"""Lights and ground: with shadows, or plain for software rendering."""

from unittest.mock import MagicMock

import pytest

from cellwright.viewer.web import program
from cellwright.viewer.web.scene import PLAIN, Environment


def environment() -> Environment:
    """Those of a page."""
    return next(each for each in program.features() if isinstance(each, Environment))


@pytest.mark.parametrize(("value", "shadows"), [(None, True), ("", True), ("0", True), ("1", False)])
def test_environment_has_shadows_unless_plain_and_at_click(
    value: str | None, shadows: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv(PLAIN, raising=False)
    if value is not None:
        monkeypatch.setenv(PLAIN, value)
    page = MagicMock(about={})
    feature = environment()
    feature.page = page
    feature.on_scene(MagicMock())
    light = page.server.scene.add_light_directional
    assert light.call_args.kwargs["cast_shadow"] is shadows
    box = page.server.gui.add_checkbox
    assert box.call_args.kwargs["initial_value"] is shadows
    (clicked,) = box.return_value.on_update.call_args.args
    box.return_value.value = not shadows
    clicked(None)
    assert light.return_value.cast_shadow is not shadows
