"""A cell's panel as HTML: the same panel gives the same text, so that nothing is drawn anew that has not changed."""

from __future__ import annotations

from typing import Any

from cellwright.viewer.web import html
from cellwright.viewer.web.html import AMBER, BLUE, GREEN, GREY, RED

Panel = dict[str, Any]

_STATES = {"init": GREY, "ready": BLUE, "go": GREEN, "end_game": AMBER, "done": BLUE}
_ORDERS = {"active": GREEN, "interrupted": AMBER, "complete": BLUE, "open": RED, "to come": GREY}
_OUTCOMES = {
    "gave_up": "the agent ended before the orders were complete",
    "crashed": "the agent crashed",
    "unstable": "the simulation became unstable",
    "until": "stopped before the competition was done",
}
"""Words for those outcomes of a run that do not speak for themselves, as in `run.result.Outcome`."""
_HELD_UP = 0.02
"""A tool farther from its goal than this [m] was held up, as in `run.collisions`, which pages do not load."""
_THERE = ("placed", "too far", "tilted", "turned", "off tray")
"""Causes of ordered parts of which a good one is on the tray."""


def head(panel: Panel) -> str:
    """What it is, how it stands, the score, and what the agent is about."""
    about, score = panel["about"], panel["score"]
    facts = [f"agent {about['agent']}"] if about.get("agent") else []
    facts += [f"seed {about['seed']}", f"servo {about['servo']}"]
    facts += ["development mode"] if panel["development"] else []
    parts = [
        html.row(
            f'<b style="font-size:1.15em">{html.text(panel["name"])}</b>',
            _state_chip(panel["state"], _STATES.get(panel["state"], GREY), panel),
            "align-items:center",
        ),
        html.dim(" · ".join(facts)),
        html.line(html.big(f"{score['total']:g}", _of_how_many(score))),
    ]
    intention = panel.get("intention")
    if intention is not None:
        what = html.text(intention["text"])
        parts.append(
            html.dim(f"last: {intention['text']}") if _is_over(panel) else html.mark("➤", BLUE, f"<b>{what}</b>")
        )
    found = panel.get("collisions")
    if found and found["latest"]:
        more = f" ({found['count']} collisions)" if found["count"] > 1 else ""
        parts.append(html.mark("✸", RED, html.text(_collision(found["latest"][-1]) + more)))
    return html.block(*parts) + result(panel)


def game(panel: Panel) -> str:
    """How long the game has gone on, and what is left of its time."""
    spent, limit = panel["clock"]["process_time"], panel["time_limit"]
    if panel["state"] in ("init", "ready"):
        return html.block(html.dim("the competition has not begun"))
    carried = f"parts carried for {panel['clock']['part_travel_time']:.0f} s"
    if limit is None:
        return html.block(html.row("game", f"{spent:.0f} s, {carried}"))
    parts = (
        html.row("game", f"{spent:.0f} of {limit:g} s, {carried}"),
        html.bar(spent / limit if limit else 1.0, AMBER if limit and spent > 0.9 * limit else BLUE),
    )
    return html.block(*parts)


def result(panel: Panel) -> str:
    """How the run ended, with its score; nothing while it has not."""
    found = panel.get("result")
    if found is None:
        return ""
    is_done = found["outcome"] == "done"
    reason = panel.get("end_reason")
    score = panel["score"]
    parts = [
        html.row(
            f"<b>the run is over: {html.text(_OUTCOMES.get(found['outcome'], found['outcome']).replace('_', ' '))}</b>",
            f"{found['simulated']:.1f} s in {found['wall']:.1f} s",
        ),
        html.text(f"{score['total']:g} {_of_how_many(score)}"),
        html.dim(reason) if reason else "",
        html.dim(f"state hash {found['state_hash'][:16]}…"),
    ]
    if found["error"]:
        parts.append(f'<pre style="white-space:pre-wrap;font-size:0.85em">{html.text(found["error"][-2000:])}</pre>')
    return html.block(*parts, style=f"border-left:0.3em solid {GREEN if is_done else RED};margin:0.3em 0.6em")


def orders(panel: Panel) -> str:
    """Each order with its kits, and a tick for each part that is there."""
    if not panel["orders"]:
        return html.block(html.dim("no order has been announced yet"))
    judged = _kits_by_type(panel)
    return html.joined(_order(order, panel, judged) for order in panel["orders"])


def trays(panel: Panel) -> str:
    """What lies on each tray, as it last reported, and what it would earn now."""
    return html.joined(_tray(tray, agv, panel) for tray, agv in zip(panel["trays"], panel["agvs"], strict=True))


def evidence(panel: Panel) -> str:
    """The score, each point with its reason."""
    score = panel["score"]
    parts = [html.dim(score["reachable_reason"])] if score["reachable_reason"] else []
    kits = [kit for order in score["orders"] for kit in order["kits"]]
    if not kits:
        parts.append(html.dim("nothing has been ordered yet"))
    return html.block(*parts) + html.joined(map(_judged, kits))


def floor(panel: Panel) -> str:
    """Belt, gripper, AGVs, and what the arm hit, the newest first."""
    belt, gripper = panel["belt"], panel["gripper"]
    parts = [html.dim("as it stood at the end")] if _is_over(panel) else []
    parts += [html.row("belt", f"{belt['power']:g} %" + ("" if belt["population"] is None else _parts_come(belt)))]
    if gripper is not None:
        held = _part_name(gripper["part"]) if gripper["part"] else "something" if gripper["attached"] else "nothing"
        suction = "on" if gripper["enabled"] else "off"
        parts.append(html.row("gripper", f"suction {suction}, holds {html.text(held)}"))
    parts += [html.row(f"AGV {agv['number']}", html.text(agv["state"].replace("_", " "))) for agv in panel["agvs"]]
    return html.block(*parts) + _collisions(panel.get("collisions"))


def _collisions(found: Panel | None) -> str:
    if found is None:
        return ""
    parts = [html.title("Collisions of the arm", html.text(found["count"]))]
    parts += [html.mark("✸", RED, html.text(_collision(each))) for each in reversed(found["latest"])]
    if len(found["latest"]) < found["count"]:
        parts.append(html.dim(f"and {found['count'] - len(found['latest'])} before"))
    return html.block(*parts)


def _collision(each: Panel) -> str:
    """A collision in words; one that still lasts has no end."""
    lasted = "" if each["end"] is None else f" for {each['end'] - each['begin']:.1f} s"
    held_up = f"; tool held up {each['deviation'] * 1e3:.0f} mm" if each["deviation"] > _HELD_UP else ""
    return f"t {each['begin']:.1f} s  {each['link']} against {each['obstacle']}{lasted}{held_up}"


def _is_over(panel: Panel) -> bool:
    return panel.get("result") is not None


def _state_chip(state: str, color: str, panel: Panel) -> str:
    """A state as a chip. When the run is over nothing goes on from it: the chip says how it stood then."""
    words = state.replace("_", " ")
    return html.chip(f"{words} at the end", GREY) if _is_over(panel) and state != "done" else html.chip(words, color)


# ---------------------------------------------------------------- orders and trays


def _order(order: Panel, panel: Panel, judged: dict[str, Panel]) -> str:
    taken = panel["clock"]["orders"].get(order["order_id"])
    is_coming = order["status"] == "to come" and order["start_time"] is not None
    when = f"at {order['start_time']:g} s" if is_coming else "" if taken is None else f"{taken:.0f} s"
    label = html.chip(order["status"], _ORDERS.get(order["status"], GREY))
    parts = [html.title(order["order_id"], f"{html.figures(when)} {label}")]
    for kit in order["kits"]:
        found, where = _best_guess(kit, panel, judged)
        there = sum(1 for part in found if part in _THERE)
        parts.append(html.row(html.text(kit["kit_type"]), html.text(where or f"{there} of {len(found)}")))
        parts.append(html.bar(there / len(found) if found else 1.0, GREEN))
        parts += [_tick(name, cause) for name, cause in zip(kit["parts"], found, strict=True)]
    return html.block(*parts)


def _best_guess(kit: Panel, panel: Panel, judged: dict[str, Panel]) -> tuple[list[str], str]:
    """What became of each part of a kit: as it was judged, or on the tray that would earn most as this kit."""
    if kit["submitted"] and kit["kit_type"] in judged:
        found = judged[kit["kit_type"]]
        return [part["cause"] for part in found["parts"]], f"sent: {found['total']:g} of {found['best']:g}"
    previews = [each for tray in panel["trays"] for each in tray["as_kits"] if each["kit_type"] == kit["kit_type"]]
    if not previews:
        return ["missing"] * len(kit["parts"]), ""
    best = max(previews, key=lambda each: each["total"])
    return [part["cause"] for part in best["parts"]], ""


def _tick(name: str, cause: str) -> str:
    if cause == "placed":
        return html.mark("✓", GREEN, html.text(name))
    if cause in _THERE:
        return html.mark("✓", AMBER, f"{html.text(name)} <span style='opacity:0.7'>({html.text(cause)})</span>")
    sign, color = ("✗", RED) if cause == "faulty" else ("·", GREY)
    more = " (faulty)" if cause == "faulty" else ""
    return html.mark(sign, color, f"<span style='opacity:0.75'>{html.text(name + more)}</span>")


def _tray(tray: Panel, agv: Panel, panel: Panel) -> str:
    label = _state_chip(agv["state"], GREEN if agv["state"] == "ready_to_deliver" else AMBER, panel)
    when = "at the end" if _is_over(panel) else "now"
    parts = [html.title(f"AGV {tray['number']}", label)]
    for part in tray["parts"]:
        faulty = f" <b style='color:{RED}'>faulty</b>" if part["faulty"] else ""
        parts.append(html.mark("▪", BLUE, html.text(_part_name(part["name"])) + faulty))
    if not tray["parts"]:
        parts.append(html.dim("empty"))
    for kit in tray["as_kits"] if tray["parts"] else ():
        parts.append(html.row(f"as {html.text(kit['kit_type'])} {when}", f"{kit['total']:g} of {kit['best']:g}"))
        parts.append(html.bar(kit["total"] / kit["best"] if kit["best"] else 0.0, BLUE))
    return html.block(*parts)


def _part_name(name: str) -> str:
    """The name of a part without where it came from."""
    return name.rpartition("|")[2]


def _parts_come(belt: Panel) -> str:
    return ", parts come" if belt["population"] else ", no parts come"


# ---------------------------------------------------------------- the score


def _of_how_many(score: Panel) -> str:
    if score["best"] is None:
        return "points"
    if score["reachable"] == score["best"]:
        return f"of {score['best']:g} points"
    return f"of {score['best']:g} points; {score['reachable']:g} can be had"


def _kits_by_type(panel: Panel) -> dict[str, Panel]:
    return {kit["kit_type"]: kit for order in panel["score"]["orders"] for kit in order["kits"]}


def _judged(kit: Panel) -> str:
    parts = [html.title(kit["kit_type"], f"{kit['total']:g} of {kit['best']:g}")]
    if not kit["submitted"]:
        parts.append(html.dim("not submitted: no points"))
        return html.block(*parts)
    parts.append(
        html.dim(
            f"there {kit['part_presence']:g}, pose {kit['part_pose']:g}, "
            f"bonus {kit['all_parts_bonus']:g} ({kit['bonus_reason']})"
        )
    )
    for part in kit["parts"]:
        points = part["presence"] + part["pose"]
        sign, color = ("✓", GREEN) if points == 2 else ("✓", AMBER) if points else ("✗", RED)
        what = f"<b>{html.text(part['type'])}</b> +{points:g}{html.dim(part['sentence'])}"
        parts.append(html.mark(sign, color, what))
    for extra in kit["extras"]:
        said = f"<b>{html.text(extra['type'])}</b> {html.text(_part_name(extra['name']))}: {html.text(extra['reason'])}"
        parts.append(html.mark("✗", RED, said))
    return html.block(*parts)
