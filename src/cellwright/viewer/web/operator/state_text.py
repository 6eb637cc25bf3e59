"""What a page says of a robot, in a few lines of HTML. Names and reasons in it come from outside."""

from __future__ import annotations

from cellwright.viewer.web import html
from cellwright.viewer.web.html import AMBER, GREEN, GREY, RED
from cellwright.viewer.web.operator.desk import Desk
from cellwright.viewer.web.operator.robot import Standing


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
    lines = [html.chip(*pill(standing))]
    if standing is not None:
        if standing.commander:
            lines[0] += f" {html.text(standing.commander)}"
        elif standing.why_not or standing.is_silent:
            lines.append(f"<div>{html.text(standing.message)}</div>")
        counts = f"{standing.taken} commands taken"
        counts += f", {standing.refused} refused" if standing.refused else ""
        counts += f", {standing.ignored} ignored" if standing.ignored else ""
        delay = desk.delay.seconds
        counts += "" if delay is None else f" · delay {delay * 1e3:.0f} ms"
        lines.append(html.dim(counts))
    note = desk.notes.at(now)
    if note:
        colour = f"color:{RED};" if desk.notes.is_bad else ""
        lines.append(f'<div style="{colour}font-weight:600">{html.text(note)}</div>')
    return html.block(*lines, style="overflow-wrap:anywhere")
