"""Panel widgets: escaped pieces of HTML. viser sends browsers only the changes of an element."""

import html
from collections.abc import Iterable

GREEN, AMBER, RED, BLUE, GREY = "#2b8a3e", "#b35c00", "#c92a2a", "#1c6ea4", "#6c757d"

_FIGURES = "font-variant-numeric:tabular-nums"  # digits of one width do not jitter


def text(value: object) -> str:
    """Text, escaped."""
    return html.escape(str(value))


def block(*parts: str, style: str = "") -> str:
    """Column of pieces, with the panel's margins."""
    return f'<div style="padding:0.15em 0.75em;font-size:0.875em;line-height:1.45;{style}">{"".join(parts)}</div>'


def line(*parts: str, style: str = "") -> str:
    """Row of pieces."""
    return f'<div style="display:flex;gap:0.5em;align-items:baseline;{style}">{"".join(parts)}</div>'


def row(left: str, right: str, style: str = "") -> str:
    """Row with a piece at the left end and one at the right end."""
    return (
        f'<div style="display:flex;justify-content:space-between;gap:0.75em;{style}">'
        f'<div style="min-width:0">{left}</div><div style="white-space:nowrap;{_FIGURES}">{right}</div></div>'
    )


def chip(label: str, color: str) -> str:
    """Word on a coloured ground."""
    return (
        f'<span style="background:{color};color:#fff;border-radius:0.9em;padding:0.1em 0.65em;font-size:0.85em;'
        f'font-weight:600;white-space:nowrap">{text(label)}</span>'
    )


def big(value: str, small: str = "") -> str:
    """Large number, and a few words behind it."""
    return (
        f'<span style="font-size:2.1em;font-weight:700;line-height:1.15;{_FIGURES}">{text(value)}</span>'
        f'<span style="opacity:0.7"> {text(small)}</span>'
    )


def title(value: str, right: str = "") -> str:
    """Heading, with a piece at its right end."""
    return row(f'<b style="font-size:1.05em">{text(value)}</b>', right, "margin-top:0.5em;align-items:baseline")


def dim(value: str) -> str:
    """A remark."""
    return f'<div style="opacity:0.7">{text(value)}</div>'


def mark(sign: str, color: str, content: str) -> str:
    """Line with a sign before it."""
    return (
        f'<div style="display:flex;gap:0.5em"><span style="color:{color};font-weight:700;width:1em;flex:none">{sign}'
        f"</span><span>{content}</span></div>"
    )


def bar(share: float, color: str) -> str:
    """Progress bar, 0..1."""
    width = 100.0 * min(max(share, 0.0), 1.0)
    return (
        '<div style="background:rgba(128,128,128,0.25);border-radius:0.25em;height:0.4em;margin:0.2em 0">'
        f'<div style="background:{color};width:{width:.1f}%;height:100%;border-radius:0.25em"></div></div>'
    )


def figures(value: str) -> str:
    """Text whose digits have one width."""
    return f'<span style="{_FIGURES}">{text(value)}</span>'


def quoted(lines: Iterable[str]) -> str:
    """Lines of a program's output, as they are; of many the last are in sight, and the others by scrolling."""
    return (
        '<div style="display:flex;flex-direction:column-reverse;max-height:20em;overflow:auto;margin:0.2em 0;'
        'border-radius:0.3em;background:rgba(128,128,128,0.14)">'
        '<pre style="white-space:pre-wrap;overflow-wrap:anywhere;font-size:0.8em;line-height:1.4;margin:0;'
        f'padding:0.5em 0.6em">{text(chr(10).join(lines))}</pre></div>'
    )
