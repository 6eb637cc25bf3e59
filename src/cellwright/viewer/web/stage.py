"""Light, sky and ground of the page."""

from __future__ import annotations

from typing import Any

from cellwright.rendering.scene import Scene
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.page import Page
from cellwright.viewer.web.shadows import lamp_of
from cellwright.viewer.web.views import TAB

PLAIN = "CELLWRIGHT_PAGE_PLAIN"
"""Where this is set in the environment, a page begins without shadows."""

HAZE = (203, 212, 221)
"""Colour in which the ground ends and the sky begins."""

_BRAND = (28, 100, 160)
_FADE_FROM, _FADE_TO = 11.0, 34.0  # [m] from the eye
_SKY = 60.0  # [m]: radius of what is drawn behind everything; at such a distance it is all haze


class Stage(Feature):
    """Sets the stage once.

    Args:
        is_plain: whether it begins without shadows.
    """

    def __init__(self, *, is_plain: bool = False) -> None:
        self._is_plain = is_plain
        self._key: Any = None

    def begin(self, page: Page, scene: Scene) -> None:  # noqa: ARG002
        """Light, sky, ground."""
        server = page.server
        server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=_BRAND)
        if self._key is not None:
            self._key.position = lamp_of(page.about)
            return
        nodes = server.scene
        nodes.configure_default_lights(enabled=False)
        nodes.configure_environment_map("warehouse", environment_intensity=0.12)
        key = self._key = nodes.add_light_directional(
            "/light/key",
            color=(255, 246, 232),
            intensity=2.7,
            cast_shadow=not self._is_plain,
            position=lamp_of(page.about),
        )
        nodes.add_light_hemisphere(
            "/light/sky", sky_color=(225, 236, 255), ground_color=(190, 180, 168), intensity=1.25
        )
        nodes.configure_fog(_FADE_FROM, _FADE_TO, color=HAZE)
        nodes.add_icosphere(
            "/sky", _SKY, color=HAZE, subdivisions=2, side="back", cast_shadow=False, receive_shadow=False
        )
        nodes.add_grid(
            "/ground",
            infinite_grid=True,
            cell_size=1.0,
            section_size=1.0,
            cell_color=(165, 168, 172),
            section_color=(165, 168, 172),
            cell_thickness=1.0,
            section_thickness=1.0,
            fade_distance=26.0,
            shadow_opacity=0.0,
            position=(0.0, 0.0, 0.002),
        )
        with page.tab(TAB):
            box = server.gui.add_checkbox(
                "Shadows", initial_value=not self._is_plain, hint="They cost a slow computer most"
            )

        @box.on_update
        def _(_event: Any) -> None:
            key.cast_shadow = box.value
