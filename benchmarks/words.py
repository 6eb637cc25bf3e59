"""How a figure is written down, for a terminal and for a page."""

from __future__ import annotations

import math

from benchmarks.figures import Figure


def value(figure: Figure) -> str:
    """The value in about three digits and its unit; a dash where there is none."""
    if not math.isfinite(figure.value):
        return "-"
    return f"{number(figure.value)} {figure.unit}".rstrip()


def number(value: float) -> str:
    """A number in about three digits, never as a power of ten; what was counted, whole."""
    size = abs(value)
    if isinstance(value, int) or size >= 100:
        return f"{value:.0f}"
    return f"{value:.{1 if size >= 10 else 2 if size >= 1 else 3}f}"


def bound(figure: Figure) -> str:
    """The bound that the value is held to; empty where there is none."""
    bounds = [f"{sign} {limit:.4g}" for sign, limit in (("≥", figure.least), ("≤", figure.most)) if limit is not None]
    return ", ".join(bounds)


def verdict(figure: Figure) -> str:
    """Whether the bound is held; empty where there is none."""
    if not bound(figure):
        return ""
    return "held" if figure.is_held else "NOT HELD"
