"""What a page is made of: features, each of which shows one thing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cellwright.rendering.scene import Scene
from cellwright.viewer.web.moment import Moment

if TYPE_CHECKING:
    from cellwright.viewer.web.page import Page


class Feature:
    """One thing that a page shows, or lets one do. All of its methods are called in the page's own thread.

    What viser calls when somebody clicks runs in threads of viser's: it may ask `page.link`, and may set handles.
    """

    def begin(self, page: Page, scene: Scene) -> None:
        """A scene is shown from now on: the first one, or another in its place.

        Handles of the scene before are gone already when they are below `page.root`; those of the GUI are not.
        """

    def wants(self) -> dict[str, Any]:
        """What the frame service is to be asked for besides frames, such as `{"contacts": True}`."""
        return {}

    def show(self, moment: Moment) -> None:
        """Show what is at this moment: some 60 times a second while somebody looks on."""

    def told(self, answer: dict[str, Any]) -> None:
        """What the frame service answered, with all that features wanted: up to 30 times a second."""

    def panel(self, panel: dict[str, Any]) -> None:
        """What the panel service answered: a few times a second, while somebody looks on."""

    def away(self, reason: str) -> None:
        """Nobody answers any more; what is shown is the last that was known."""

    def back(self) -> None:
        """Somebody answers again; `begin` follows if it is another scene."""
