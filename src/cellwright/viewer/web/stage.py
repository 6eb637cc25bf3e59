"""Light, sky and ground of the page, and from where one looks at first."""

from __future__ import annotations

from cellwright.rendering.views import VIEWS
from cellwright.scene import Scene
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.page import Page


class Stage(Feature):
    """Sets the stage once."""

    def begin(self, page: Page, scene: Scene) -> None:  # noqa: ARG002
        """Light, sky, camera."""
        server = page.server
        server.gui.configure_theme(show_logo=False, show_share_button=False, brand_color=(36, 96, 140))
        camera = server.initial_camera
        view = VIEWS["overview"]
        camera.position, camera.look_at, camera.up, camera.fov = view.eye, view.target, view.up, view.fov
        camera.near, camera.far = 0.02, 120.0
