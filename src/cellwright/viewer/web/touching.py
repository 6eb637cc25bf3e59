"""Where things touch, and how hard."""

from __future__ import annotations

from typing import Any

import numpy as np

from cellwright.rendering.scene import Scene
from cellwright.viewer.web.feature import Feature
from cellwright.viewer.web.page import Page
from cellwright.viewer.web.views import TAB

_COLOUR = (0.86, 0.15, 0.2)
_PER_NEWTON = 0.01  # [m]
_SHORTEST, _LONGEST = 0.015, 0.4  # [m]
_SHAFT, _HEAD, _HEAD_LENGTH = 0.003, 0.007, 0.015  # [m]


class Contacts(Feature):
    """An arrow for each contact, as long as its force is strong."""

    def __init__(self) -> None:
        self._page: Page | None = None
        self._box: Any = None
        self._handle: Any = None

    def begin(self, page: Page, scene: Scene) -> None:  # noqa: ARG002
        """Offer it."""
        self._page, self._handle = page, None
        if self._box is None:
            with page.tab(TAB):
                self._box = page.server.gui.add_checkbox(
                    "Contacts and forces",
                    initial_value=False,
                    hint="A centimetre is a newton; what is at rest sleeps, and is not told of",
                )

    def wants(self) -> dict[str, Any]:
        """Contacts, while they are shown."""
        return {"contacts": True} if self._box is not None and self._box.value else {}

    def told(self, answer: dict[str, Any]) -> None:
        """Draw them."""
        rows = answer.get("contacts")
        if self._page is None or self._box is None:
            return
        if not rows or not self._box.value:
            if self._handle is not None:
                self._handle.remove()
                self._handle = None
            return
        arrows = _arrows(np.array(rows, np.float32))
        if self._handle is None:
            self._handle = self._page.server.scene.add_arrows(
                f"{self._page.root}/contacts",
                arrows,
                _COLOUR,
                shaft_radius=_SHAFT,
                head_radius=_HEAD,
                head_length=_HEAD_LENGTH,
            )
        else:
            self._handle.points = arrows


def _arrows(rows: np.typing.NDArray[np.float32]) -> np.typing.NDArray[np.float32]:
    """Where the arrows begin and end (n, 2, 3) [m], of contacts (n, 6): they point up, away from what is below."""
    places, forces = rows[:, :3], rows[:, 3:]
    forces = np.where(forces[:, 2:] < 0, -forces, forces)
    strength = np.linalg.norm(forces, axis=1, keepdims=True)
    length = np.clip(_PER_NEWTON * strength, _SHORTEST, _LONGEST)
    ends = places + forces / np.maximum(strength, 1e-9) * length
    return np.stack([places, ends], axis=1).astype(np.float32)
