"""Time control for viewers, and the panel service that reports it.

The service `cellwright/control` takes `{"action": …}` and answers with the state as it is then:

| action | and | what it does |
|---|---|---|
| `pause`, `resume` | | lets time stand, lets it pass |
| `step` | `ticks`, 1 when left out | lets so many ticks pass, and time stand then |
| `speed` | `factor`, a number or `"max"` | simulated seconds a wall second |
| `reset` | | begins anew, where that is allowed |
| `state` | | nothing |

What is played, and not simulated, may know more: a recording goes to a `time` [s] when `seek` is asked for.

None of it is part of a run's state: a run that was paused is the same run. When the run is over, the state's `over`
says so, and all but `reset` and `state` is refused.

What a cell tells stands in `cell_panel`, what a robot tells in `robot_panel`; beside it `control` has the state that
`cellwright/control` answers with.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, TypeAlias

from cellwright.engine.rate_control import RateControl
from cellwright.middleware.server import Server
from cellwright.util.errors import RejectedCommandError, UnknownNameError
from cellwright.viewer.services.names import CONTROL, PANEL

SLOWEST, FASTEST = 0.01, 1000.0  # [simulated s a wall s] that may be asked for
MOST_TICKS = 100_000  # that may be asked for at once
FASTER_THAN_ANY = "max"  # stands for as fast as it goes

_OF_TIME = ("pause", "resume", "step", "speed")

Act: TypeAlias = Callable[[dict[str, Any]], object]
"""Does what an action asks for; refuses with a CellwrightError."""


@dataclass(frozen=True)
class Reset:
    """A way to begin anew, and why it may not be done now; empty when it may."""

    act: Callable[[], None]
    hindrance: Callable[[], str] = lambda: ""


NO_RESET = Reset(lambda: None, lambda: "it cannot begin anew here")


class Control:
    """Lets guests say how time passes.

    Args:
        tempo: how time passes.
        reset: how to begin anew.
        refused: why other actions are refused, by name: a real robot's time cannot stand.
        lockstep: whether time passes for guests that ask for it, and for nothing else.
        acts: what can be done besides, or is done otherwise here, by the name of the action; takes what was asked.
    """

    def __init__(
        self,
        tempo: RateControl,
        *,
        reset: Reset = NO_RESET,
        refused: Mapping[str, str] | None = None,
        lockstep: bool = False,
        acts: Mapping[str, Act] | None = None,
    ) -> None:
        self.tempo = tempo
        self.resets = 0
        self.over = ""
        """Why no time passes any more, such as the end of the run; empty while time may pass."""
        self._reset = reset
        self._refused = dict(refused or {})
        self._lockstep = lockstep
        self._acts = dict(acts or {})

    def state(self) -> dict[str, Any]:
        """How time passes now, and what may be done about it: `refused` has a reason for each action that may not."""
        tempo = self.tempo
        ended = dict.fromkeys(_OF_TIME, self.over) if self.over else {}
        refused = {**self._refused, **ended, "reset": self._reset.hindrance()}
        return {
            "paused": tempo.is_paused,
            "ticks_left": tempo.ticks_left,
            "speed": FASTER_THAN_ANY if tempo.speed is None else tempo.speed,
            "lockstep": self._lockstep,
            "resets": self.resets,
            "over": self.over,
            "refused": {action: reason for action, reason in refused.items() if reason},
        }

    def control(self, asked: dict[str, Any]) -> dict[str, Any]:
        """Do what is asked for; RejectedCommandError and UnknownNameError say why not."""
        acts: dict[str, Act] = {
            "pause": lambda _: self.tempo.pause(),
            "resume": lambda _: self.tempo.resume(),
            "step": lambda asked: self.tempo.step(_ticks(asked.get("ticks", 1))),
            "speed": lambda asked: self.tempo.set_speed(_speed(asked.get("factor"))),
            "reset": lambda _: self._begin_anew(),
            "state": lambda _: None,
            **self._acts,
        }
        action = asked.get("action")
        if not isinstance(action, str) or action not in acts:
            raise UnknownNameError("action", f"{action!s:.40}", acts)
        reason = self.state()["refused"].get(action)
        if reason:
            raise RejectedCommandError(reason)
        acts[action](asked)
        return self.state()

    def _begin_anew(self) -> None:
        self._reset.act()
        self.resets += 1
        self.tempo.begin_anew()


def _ticks(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 1 <= value <= MOST_TICKS:
        raise RejectedCommandError(f"ticks: a whole number from 1 to {MOST_TICKS}, not {value!r:.40}")
    return value


def _speed(value: Any) -> float | None:
    if value == FASTER_THAN_ANY:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not SLOWEST <= value <= FASTEST:
        raise RejectedCommandError(
            f'factor: a number from {SLOWEST:g} to {FASTEST:g}, or "{FASTER_THAN_ANY}", not {value!r:.40}'
        )
    return float(value)


Tell = Callable[[dict[str, Any]], dict[str, Any]]
"""Tells what a panel shows, as JSON values; takes what was asked."""


def offer_panel(server: Server, tell: Tell, control: Control) -> None:
    """Offer a panel and the control of time on a server."""
    server.offer(PANEL, lambda asked: {**tell(asked), "control": control.state()})
    server.offer(CONTROL, control.control)
