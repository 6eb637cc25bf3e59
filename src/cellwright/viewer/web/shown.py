"""What is sent to browsers only when it is another than before: HTML on the panel, and what handles are like."""

from __future__ import annotations

from typing import Any


class Shown:
    """A piece of the panel.

    Args:
        gui: viser's; the piece stands where the next one would.
        order: where it stands among its neighbours; None: behind them.
    """

    def __init__(self, gui: Any, order: float | None = None) -> None:
        self._handle = gui.add_html("", order=order)
        self._text = ""

    def show(self, text: str) -> None:
        """Show this."""
        if text != self._text:
            self._text = text
            self._handle.content = text

    def remove(self) -> None:
        """Take it away."""
        self._handle.remove()


def set_changed(handle: Any, name: str, value: Any) -> None:
    """Set something of a handle, unless it is so already."""
    if getattr(handle, name) != value:
        setattr(handle, name, value)
