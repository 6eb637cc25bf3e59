"""What a page says of a robot, in a few lines of HTML. Names and reasons in it come from outside."""

from __future__ import annotations

from html import escape

from cellwright.viewer.web.operator.desk import Desk
from cellwright.viewer.web.operator.robot import Standing

RED, AMBER, GREEN, GREY = "#c62828", "#b26a00", "#2e7d32", "#607080"


def pill(standing: Standing | None) -> tuple[str, str]:
    """The robot's state in two or three words, and its colour."""
    if standing is None:
        return "not heard from", GREY
    if standing.is_stopped:
        return "EMERGENCY STOP", RED
    if not standing.is_enabled:
        return "switched off", AMBER
    if standing.is_homing:
        return "going home", AMBER
    if standing.is_silent:
        return "held", AMBER
    return ("follows", GREEN) if standing.commander else ("waits", GREY)


def state_html(desk: Desk, now: float) -> str:
    """State, who commands, what was refused, the delay, and the newest note."""
    standing = desk.standing
    word, colour = pill(standing)
    lines = [
        f'<span style="background:{colour};color:white;border-radius:4px;padding:1px 8px;font-weight:600">{word}</span>'
    ]
    if standing is not None:
        if standing.commander:
            lines[0] += f" {escape(standing.commander)}"
        elif standing.why_not or standing.is_silent:
            lines.append(escape(standing.message))
        counts = f"{standing.taken} commands taken"
        counts += f", {standing.refused} refused" if standing.refused else ""
        counts += f", {standing.ignored} ignored" if standing.ignored else ""
        delay = desk.delay.seconds
        counts += "" if delay is None else f" · delay {delay * 1e3:.0f} ms"
        lines.append(f'<span style="opacity:0.7">{counts}</span>')
    note = desk.notes.at(now)
    if note:
        colour = f"color:{RED};" if desk.notes.is_bad else ""
        lines.append(f'<span style="{colour}font-weight:600">{escape(note)}</span>')
    body = "<br>".join(lines)
    return f'<div style="font-size:0.82em;line-height:1.6;padding:0 0.9em;overflow-wrap:anywhere">{body}</div>'
