"""Cell panels: state, orders, trays and score as HTML, and controls of belt, AGVs and trays."""

import time
from functools import partial
from typing import Any

from cellwright.middleware.messages.osrf_gear import AGVControlRequest, ConveyorBeltControlRequest, ConveyorBeltState
from cellwright.middleware.messages.std_srvs import TriggerRequest
from cellwright.rendering.scene import Scene
from cellwright.util.errors import CellwrightError
from cellwright.viewer.services.names import MIN_DEVIATION
from cellwright.viewer.web import widgets
from cellwright.viewer.web.page import Feature
from cellwright.viewer.web.widgets import AMBER, BLUE, GREEN, GREY, RED

Panel = dict[str, Any]

_STATE_COLOURS = {"init": GREY, "ready": BLUE, "go": GREEN, "end_game": AMBER, "done": BLUE}
_ORDER_COLOURS = {"active": GREEN, "interrupted": AMBER, "complete": BLUE, "open": RED, "to come": GREY}
_OUTCOMES = {
    "task_failed": "the task has not succeeded",
    "gave_up": "the agent ended before the orders were complete",
    "crashed": "the agent crashed",
    "infrastructure": "the policy could not be asked",
    "unstable": "the simulation became unstable",
    "until": "stopped before the competition was done",
}
"""Words for outcomes that need an explanation, as in `run.result.Outcome`."""
_THERE = ("placed", "too far", "tilted", "turned", "off tray")
"""Causes of ordered parts of which a good one is on the tray."""

ORDERS, SCORE, CELL = "Orders", "Score", "Cell"  # tabs
START, END = "Start", "End"
_GAME = {START: "/ariac/start_competition", END: "/ariac/end_competition"}
STRANGE = (KeyError, TypeError, ValueError, IndexError, AttributeError)
"""Errors of a panel that another version recorded, or that is none; they must not end the page."""
_SETTLED = 1.5  # [s] after a click on the belt's slider before it follows the belt again
_PANEL_ORDER = -20.0  # above all else


def head_html(panel: Panel) -> str:
    """Name, state, score, and the agent's intention."""
    about, score = panel["about"], panel["score"]
    facts = [f"agent {about['agent']}"] if about.get("agent") else []
    facts += [f"seed {about['seed']}", f"servo {about['servo']}"]
    facts += ["development mode"] if panel["development"] else []
    parts = [
        widgets.row(
            f'<b style="font-size:1.15em">{widgets.text(panel["name"])}</b>',
            _state_chip(panel["state"], _STATE_COLOURS.get(panel["state"], GREY), panel),
            "align-items:center",
        ),
        widgets.dim(" · ".join(facts)),
        widgets.line(widgets.big(f"{score['total']:g}", _of_how_many(score))),
    ]
    if (intention := panel.get("intention")) is not None:
        text = intention["text"]
        now = widgets.mark("➤", BLUE, f"<b>{widgets.text(text)}</b>")
        parts.append(widgets.dim(f"last: {text}") if _is_over(panel) else now)
    found = panel.get("collisions")
    if found and found["latest"]:
        more = f" ({found['count']} collisions)" if found["count"] > 1 else ""
        parts.append(widgets.mark("✸", RED, widgets.text(_collision(found["latest"][-1]) + more)))
    return widgets.block(*parts) + result_html(panel)


def game_html(panel: Panel) -> str:
    """Elapsed and remaining time of the game."""
    spent, limit = panel["clock"]["process_time"], panel["time_limit"]
    if panel["state"] in ("init", "ready"):
        return widgets.block(widgets.dim("the competition has not started"))
    carried = f"parts carried for {panel['clock']['part_travel_time']:.0f} s"
    if limit is None:
        return widgets.block(widgets.row("game", f"{spent:.0f} s, {carried}"))
    bar = widgets.bar(spent / limit if limit else 1.0, AMBER if limit and spent > 0.9 * limit else BLUE)
    return widgets.block(widgets.row("game", f"{spent:.0f} of {limit:g} s, {carried}"), bar)


def result_html(panel: Panel) -> str:
    """End of the run with its score; empty while it runs."""
    found = panel.get("result")
    if found is None:
        return ""
    is_done = found["outcome"] == "done"
    reason = panel.get("end_reason")
    score = panel["score"]
    outcome = _OUTCOMES.get(found["outcome"], found["outcome"]).replace("_", " ")
    parts = [
        widgets.row(
            f"<b>the run is over: {widgets.text(outcome)}</b>", f"{found['simulated']:.1f} s in {found['wall']:.1f} s"
        ),
        widgets.text(f"{score['total']:g} {_of_how_many(score)}"),
        widgets.dim(reason) if reason else "",
        widgets.dim(f"state hash {found['state_hash'][:16]}…"),
    ]
    if found["error"]:
        parts.append(f'<pre style="white-space:pre-wrap;font-size:0.85em">{widgets.text(found["error"][-2000:])}</pre>')
    return widgets.block(*parts, style=f"border-left:0.3em solid {GREEN if is_done else RED};margin:0.3em 0.6em")


def orders_html(panel: Panel) -> str:
    """Orders with their kits, and a tick for each part on its tray."""
    if not panel["orders"]:
        return widgets.block(widgets.dim("no order announced yet"))
    judged = {kit["kit_type"]: kit for order in panel["score"]["orders"] for kit in order["kits"]}
    return "".join(_order(order, panel, judged) for order in panel["orders"])


def trays_html(panel: Panel) -> str:
    """Last reported contents of each tray, and its points if sent now."""
    return "".join(_tray(tray, sender, panel) for tray, sender in zip(panel["trays"], _senders(panel), strict=True))


def evidence_html(panel: Panel) -> str:
    """Score, each point with its reason."""
    score = panel["score"]
    parts = [widgets.dim(score["reachable_reason"])] if score["reachable_reason"] else []
    kits = [kit for order in score["orders"] for kit in order["kits"]]
    if not kits:
        parts.append(widgets.dim("no orders yet"))
    return widgets.block(*parts) + "".join(map(_judged, kits))


def floor_html(panel: Panel) -> str:
    """Belts, grippers, AGVs, and collisions of arms, the newest first."""
    parts = [widgets.dim("state at the end of the run")] if _is_over(panel) else []
    for belt in panel["belts"]:
        come = "" if belt["population"] is None else ", parts arriving" if belt["population"] else ", no parts arriving"
        parts.append(widgets.row(widgets.text(belt["name"]), f"{belt['power']:g} %{come}"))
    for gripper in panel["grippers"]:
        held = _part_name(gripper["part"]) if gripper["part"] else "something" if gripper["attached"] else "nothing"
        state = f"suction {'on' if gripper['enabled'] else 'off'}"
        if gripper["width"] is not None:
            state = f"open {1e3 * gripper['width']:.0f} mm"
        parts.append(widgets.row(widgets.text(gripper["name"]), f"{state}, holds {widgets.text(held)}"))
    states = [(_label(each), widgets.text(each["state"].replace("_", " "))) for each in _senders(panel)]
    parts += [widgets.row(widgets.text(label), state) for label, state in states]
    floor = widgets.block(*parts)
    if (found := panel.get("collisions")) is None:
        return floor
    parts = [widgets.title("Collisions", widgets.text(found["count"]))]
    parts += [widgets.mark("✸", RED, widgets.text(_collision(each))) for each in reversed(found["latest"])]
    if (nearest := found.get("nearest")) is not None:
        where = f"{nearest['distance'] * 1e3:.0f} mm, {nearest['link']} to {nearest['other']}"
        parts.append(widgets.row("nearest", widgets.text(where)))
    if len(found["latest"]) < found["count"]:
        parts.append(widgets.dim(f"and {found['count'] - len(found['latest'])} earlier"))
    return floor + widgets.block(*parts)


def _collision(each: Panel) -> str:
    """Text of a collision; one that still lasts has no end."""
    lasted = "" if each["end"] is None else f" for {each['end'] - each['begin']:.1f} s"
    deviation = f"; tool {each['deviation'] * 1e3:.0f} mm from its goal" if each["deviation"] > MIN_DEVIATION else ""
    return f"t {each['begin']:.1f} s  {each['link']} against {each['obstacle']}{lasted}{deviation}"


def _is_over(panel: Panel) -> bool:
    return panel.get("result") is not None


def _state_chip(state: str, color: str, panel: Panel) -> str:
    """Chip of a state. After the run it says that this was the state at the end."""
    words = state.replace("_", " ")
    is_left = _is_over(panel) and state != "done"
    return widgets.chip(f"{words} at the end", GREY) if is_left else widgets.chip(words, color)


def _order(order: Panel, panel: Panel, judged: dict[str, Panel]) -> str:
    taken = panel["clock"]["orders"].get(order["order_id"])
    is_coming = order["status"] == "to come" and order["start_time"] is not None
    when = f"at {order['start_time']:g} s" if is_coming else "" if taken is None else f"{taken:.0f} s"
    label = widgets.chip(order["status"], _ORDER_COLOURS.get(order["status"], GREY))
    parts = [widgets.title(order["order_id"], f"{widgets.figures(when)} {label}")]
    for kit in order["kits"]:
        found, where = _best_guess(kit, panel, judged)
        there = sum(1 for part in found if part in _THERE)
        parts.append(widgets.row(widgets.text(kit["kit_type"]), widgets.text(where or f"{there} of {len(found)}")))
        parts.append(widgets.bar(there / len(found) if found else 1.0, GREEN))
        parts += [_tick(name, cause) for name, cause in zip(kit["parts"], found, strict=True)]
    return widgets.block(*parts)


def _best_guess(kit: Panel, panel: Panel, judged: dict[str, Panel]) -> tuple[list[str], str]:
    """Cause for each part of a kit: as judged, or on the tray with the most points as this kit."""
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
        return widgets.mark("✓", GREEN, widgets.text(name))
    if cause in _THERE:
        why = f"<span style='opacity:0.7'>({widgets.text(cause)})</span>"
        return widgets.mark("✓", AMBER, f"{widgets.text(name)} {why}")
    sign, color = ("✗", RED) if cause == "faulty" else ("·", GREY)
    more = " (faulty)" if cause == "faulty" else ""
    return widgets.mark(sign, color, f"<span style='opacity:0.75'>{widgets.text(name + more)}</span>")


def _senders(panel: Panel) -> list[Panel]:
    """AGVs and fixed trays, in the order of their trays."""
    return [*panel["agvs"], *panel.get("fixed_trays", ())]


def _label(sender: Panel) -> str:
    """Name of an AGV or a fixed tray for readers: `AGV 1` for agv1."""
    name = str(sender.get("name", f"agv{sender['number']}"))
    return f"AGV {sender['number']}" if name == f"agv{sender['number']}" else name


def _tray(tray: Panel, sender: Panel, panel: Panel) -> str:
    label = _state_chip(sender["state"], GREEN if sender["state"] == "ready_to_deliver" else AMBER, panel)
    when = "at the end" if _is_over(panel) else "now"
    parts = [widgets.title(widgets.text(_label(sender)), label)]
    for part in tray["parts"]:
        faulty = f" <b style='color:{RED}'>faulty</b>" if part["faulty"] else ""
        parts.append(widgets.mark("▪", BLUE, widgets.text(_part_name(part["name"])) + faulty))
    if not tray["parts"]:
        parts.append(widgets.dim("empty"))
    for kit in tray["as_kits"] if tray["parts"] else ():
        parts.append(widgets.row(f"as {widgets.text(kit['kit_type'])} {when}", f"{kit['total']:g} of {kit['best']:g}"))
        parts.append(widgets.bar(kit["total"] / kit["best"] if kit["best"] else 0.0, BLUE))
    return widgets.block(*parts)


def _part_name(name: str) -> str:
    """Name of a part without its origin."""
    return name.rpartition("|")[2]


def _of_how_many(score: Panel) -> str:
    if score["best"] is None:
        return "points"
    if score["reachable"] == score["best"]:
        return f"of {score['best']:g} points"
    return f"of {score['best']:g} points; {score['reachable']:g} attainable"


def _judged(kit: Panel) -> str:
    parts = [widgets.title(kit["kit_type"], f"{kit['total']:g} of {kit['best']:g}")]
    if not kit["submitted"]:
        cause = kit["parts"][0]["cause"] if kit["parts"] else "not submitted"  # of all parts
        parts.append(widgets.dim(f"{cause}: no points"))
        return widgets.block(*parts)
    points = f"presence {kit['part_presence']:g}, pose {kit['part_pose']:g}, bonus {kit['all_parts_bonus']:g}"
    parts.append(widgets.dim(f"{points} ({kit['bonus_reason']})"))
    for part in kit["parts"]:
        points = part["presence"] + part["pose"]
        sign, color = ("✓", GREEN) if points == 2 else ("✓", AMBER) if points else ("✗", RED)
        text = f"<b>{widgets.text(part['type'])}</b> +{points:g}{widgets.dim(part['sentence'])}"
        parts.append(widgets.mark(sign, color, text))
    for extra in kit["extras"]:
        kind, notice = widgets.text(extra["type"]), widgets.text(f"{_part_name(extra['name'])}: {extra['reason']}")
        parts.append(widgets.mark("✗", RED, f"<b>{kind}</b> {notice}"))
    return widgets.block(*parts)


class CellPanels(Feature):
    """Panels of a cell, live or recorded."""

    def __init__(self) -> None:
        self._is_up = False
        self._slid_at = -_SETTLED

    def on_scene(self, scene: Scene) -> None:  # noqa: ARG002
        """Create the panels, once, if the page shows a cell."""
        cell = cell_of(self.page.first_panel)
        if not self._is_up and cell is not None:
            # Put up now, so that its tabs come first.
            self._put_up(cell)

    def panel(self, panel: dict[str, Any]) -> None:
        """Show the state of the cell."""
        cell = cell_of(panel)
        if cell is None:
            return
        if not self._is_up:
            self._put_up(cell)
        is_recorded = panel.get("kind") != "cell"
        try:
            self._show(cell)
            notice = "recordings are read-only" if is_recorded else ""
            self._offer(notice or cell["refused"].get("belt", ""))
        except STRANGE as error:
            notice = widgets.dim(f"Panel of another version cannot be shown: {error!r}")
            self._head.content = widgets.block(notice)

    def on_disconnect(self, reason: str) -> None:
        """Disable the controls: the server does not answer."""
        if self._is_up:
            self._offer(reason)

    def _put_up(self, cell: Panel) -> None:
        page = self.page
        self._is_up, gui = True, page.server.gui
        self._head = gui.add_html("", order=_PANEL_ORDER)
        self._time = gui.add_html("", order=_PANEL_ORDER / 4)
        with page.tab(ORDERS):
            self._orders, self._trays = gui.add_html(""), gui.add_html("")
        with page.tab(SCORE):
            self._evidence = gui.add_html("")
        with page.tab(CELL):
            self._floor = gui.add_html("")
            self._why_not = gui.add_html("")
            self._game = gui.add_button_group("competition", (START, END))
            self._belts = {
                belt["service"]: gui.add_slider(f"{belt['name']} [%]", min=0.0, max=100.0, step=1.0, initial_value=0.0)
                for belt in cell.get("belts", ())
            }
            self._kit = gui.add_dropdown("kit", ("(none)",))
            senders = {_label(each): f"/ariac/{each['name']}" for each in _senders(cell)}
            trays = {f"tray {each['number']}": f"/ariac/kit_tray_{each['number']}" for each in _senders(cell)}
            if senders:
                self._send = gui.add_button_group("send as kit", tuple(senders))
                self._clear = gui.add_button_group("clear tray", tuple(trays))
        self._game.on_click(lambda event: self._call(_GAME[str(event.target.value)], TriggerRequest()))
        for service, slider in self._belts.items():
            slider.on_update(partial(self._set_power, service))
        self._doing: tuple[Any, ...] = (self._game, *self._belts.values(), self._kit)
        if senders:
            self._doing += (self._send, self._clear)
            self._send.on_click(lambda event: self._send_off(senders[str(event.target.value)]))
            self._clear.on_click(
                lambda event: self._call(f"{trays[str(event.target.value)]}/clear_tray", TriggerRequest())
            )

    def _show(self, cell: dict[str, Any]) -> None:
        self._head.content = head_html(cell)
        self._time.content = game_html(cell)
        self._orders.content = orders_html(cell)
        self._trays.content = trays_html(cell)
        self._evidence.content = evidence_html(cell)
        self._floor.content = floor_html(cell)
        if time.perf_counter() - self._slid_at > _SETTLED:
            for belt in cell["belts"]:
                self._belts[belt["service"]].value = float(belt["power"])  # type: ignore[misc]
        kits = tuple(kit["kit_type"] for order in cell["orders"] for kit in order["kits"] if not kit["submitted"])
        if tuple(self._kit.options) != (kits or ("(none)",)):
            self._kit.options = kits or ("(none)",)

    def _offer(self, reason: str) -> None:
        """Enable the controls, unless there is a reason not to."""
        self._why_not.content = widgets.block(widgets.dim(f"Belt, AGVs and trays: {reason}.")) if reason else ""
        for handle in self._doing:
            # viser disables no group of buttons.
            handle.visible = not reason

    def _set_power(self, service: str, event: Any) -> None:
        if event.client is not None:  # not when it follows the belt
            self._slid_at = time.perf_counter()
            power = ConveyorBeltState(power=float(event.target.value))
            self._call(service, ConveyorBeltControlRequest(state=power))

    def _send_off(self, service: str) -> None:
        self._call(service, AGVControlRequest(kit_type=str(self._kit.value)))

    def _call(self, service: str, request: Any) -> None:
        try:
            response = self.page.link.call(service, request)
        except CellwrightError as error:
            self.page.notify(f"{service}: refused", str(error), is_bad=True)
            return
        if not response.success:
            notice = getattr(response, "message", "") or "no reason given"
            self.page.notify(f"{service}: refused", str(notice), is_bad=True)


def cell_of(panel: dict[str, Any]) -> dict[str, Any] | None:
    """The cell of a panel, also of a recording's panel; None if it is of no cell."""
    found = panel.get("of") if panel.get("kind") == "recording" else panel
    return found if isinstance(found, dict) and found.get("kind") == "cell" else None
