"""Controls that may be used now and again."""

from __future__ import annotations

from typing import Any

from viser import GuiButtonGroupHandle


def allow(control: Any, reason: str) -> None:
    """Let people use a control, or not. viser cannot grey out a group of buttons: such a one is out of sight then.

    Args:
        control: viser's handle.
        reason: why it may not be used; empty where it may.
    """
    name, value = ("visible", not reason) if isinstance(control, GuiButtonGroupHandle) else ("disabled", bool(reason))
    if getattr(control, name) != value:
        setattr(control, name, value)
