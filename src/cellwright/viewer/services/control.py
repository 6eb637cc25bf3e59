"""Time control for viewers, and the panel service that reports it.

The service `cellwright/control` takes `{"action": …}` and answers with the new state:

- `pause`, `resume`: stops time, lets it pass
- `step` with `ticks`, default 1: lets these ticks pass, then pauses
- `speed` with `factor`, a number or `"max"`: simulated seconds per wall second
- `reset`: starts the run again, where allowed
- `reset_state`: the same, while the clock of messages goes on
- `state`: nothing

A player may have more actions: a recording jumps to a `time` [s] on `seek`.

None of it belongs to a run's state: a paused run is the same run. When the run is over, the state's `over` says so, and
all actions but `reset`, `reset_state` and `state` are refused.

The panel of a cell is in `cell_panel`, the panel of a robot in `robot_panel`. Their key `control` holds the state that
`cellwright/control` answers with.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from cellwright.engine.rate_control import RateControl
from cellwright.middleware.server import Server
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from cellwright.viewer.services.names import CONTROL, PANEL

MIN_SPEED, MAX_SPEED = 0.01, 1000.0  # [simulated s per wall s], range of requests
MAX_TICKS = 100_000  # in one request
UNLIMITED = "max"  # as fast as possible

_OF_TIME = ("pause", "resume", "step", "speed")

Act: TypeAlias = Callable[[dict[str, Any]], object]
"""Performs an action for its request; raises a CellwrightError to refuse."""

CLOCK_STAYS = "the clock cannot go on during a reset here; use reset"
"""Reason why a state is never reset alone."""


@dataclass(frozen=True)
class Reset:
    """Reset action, and the reason why it is not possible now; empty when it is.

    Attributes:
        act: starts the run again at time 0.
        restart_refusal: returns why that is not possible now.
        act_on_state: starts the run again while the clock goes on; None if that is never possible.
        state_refusal: returns why that is not possible now, besides `restart_refusal`.
    """

    act: Callable[[], None]
    restart_refusal: Callable[[], str] = lambda: ""
    act_on_state: Callable[[], None] | None = None
    state_refusal: Callable[[], str] = lambda: ""


class Control:
    """Time control for clients.

    Args:
        rate_control: rate control of the simulation.
        reset: its reset action; None: there is none.
        refused: reasons why other actions are refused, by action; a real robot's time cannot be paused.
        lockstep: True if time advances only on request.
        acts: further actions, or replacements, by name; each takes the request.
    """

    def __init__(
        self,
        rate_control: RateControl,
        *,
        reset: Reset | None = None,
        refused: Mapping[str, str] | None = None,
        lockstep: bool = False,
        acts: Mapping[str, Act] | None = None,
    ) -> None:
        self.rate_control = rate_control
        self.resets = 0
        self.over = ""
        """Reason why time passes no more, such as the end of the run; empty while time may pass."""
        self._reset = reset or Reset(lambda: None, lambda: "restart is not available here")
        self._refused = dict(refused or {})
        self._lockstep = lockstep
        self._acts = dict(acts or {})

    def state(self) -> dict[str, Any]:
        """Return the state of time; its `refused` has a reason for each action that is refused."""
        rate_control = self.rate_control
        ended = dict.fromkeys(_OF_TIME, self.over) if self.over else {}
        refused = {**self._refused, **ended, **self._reset_refusals()}
        return {
            "paused": rate_control.is_paused,
            "ticks_left": rate_control.ticks_left,
            "speed": UNLIMITED if rate_control.speed is None else rate_control.speed,
            "lockstep": self._lockstep,
            "resets": self.resets,
            "over": self.over,
            "refused": {action: reason for action, reason in refused.items() if reason},
        }

    def control(self, request: dict[str, Any]) -> dict[str, Any]:
        """Perform the action of a request, and return the new state.

        Raises:
            UnknownNameError: there is no such action.
            RejectedCommandError: the action is refused; the text says why.
        """
        acts: dict[str, Act] = {
            "pause": lambda _: self.rate_control.pause(),
            "resume": lambda _: self.rate_control.resume(),
            "step": lambda request: self.rate_control.step(_ticks(request.get("ticks", 1))),
            "speed": lambda request: self.rate_control.set_speed(_speed(request.get("factor"))),
            "reset": lambda _: self._perform_reset(self._reset.act),
            "reset_state": lambda _: self._perform_reset(self._reset.act_on_state),
            "state": lambda _: None,
            **self._acts,
        }
        action = request.get("action")
        if not isinstance(action, str) or action not in acts:
            raise UnknownNameError("action", f"{action!s:.40}", acts)
        reason = self.state()["refused"].get(action)
        if reason:
            raise RejectedCommandError(reason)
        acts[action](request)
        return self.state()

    def _reset_refusals(self) -> dict[str, str]:
        reset, reason = self._reset, self._reset.restart_refusal()
        of_state = CLOCK_STAYS if reset.act_on_state is None else reset.state_refusal()
        return {"reset": reason, "reset_state": reason or of_state}

    def _perform_reset(self, act: Callable[[], None] | None) -> None:
        assert act is not None
        act()
        self.resets += 1
        self.rate_control.restart_pace()


def _ticks(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= MAX_TICKS:
        raise RejectedCommandError(f"ticks must be a whole number from 1 to {MAX_TICKS} (got {value!r:.40})")
    return value


def _speed(value: Any) -> float | None:
    if value == UNLIMITED:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not MIN_SPEED <= value <= MAX_SPEED:
        raise RejectedCommandError(
            f'factor must be a number from {MIN_SPEED:g} to {MAX_SPEED:g}, or "{UNLIMITED}" (got {value!r:.40})'
        )
    return float(value)


PanelSource = Callable[[dict[str, Any]], dict[str, Any]]
"""Returns a panel as JSON values; takes the request."""


def offer_panel(server: Server, panel: PanelSource, control: Control) -> PanelSource:
    """Offer a panel and time control on a server; return the panel as it is offered."""

    def answer(request: dict[str, Any]) -> dict[str, Any]:
        return {**panel(request), "control": control.state()}

    server.offer(PANEL, answer)
    server.offer(CONTROL, control.control)
    return answer
