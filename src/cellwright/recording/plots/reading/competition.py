"""What the referee of a cell did, and what it was worth."""

from __future__ import annotations

from typing import Any

import numpy as np

from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.standard import Float32, String
from cellwright.recording.format.format import EVENT
from cellwright.recording.format.reader import RecordedMessage
from cellwright.recording.plots.reading.gripper import Spans
from cellwright.recording.plots.reading.reader import SECOND, json_of
from cellwright.recording.plots.tracks import Mark, ScoreTrack
from cellwright.util.errors import MessageError

_SCORE, _STATE = "/ariac/current_score", "/ariac/competition_state"


class Competition:
    """Reads the log of the referee, the score and the state."""

    topics = (EVENT, _SCORE, _STATE)

    def __init__(self) -> None:
        self.about: dict[str, Any] = {}
        """The first line of the log: trial, agent, seed."""
        self.result: dict[str, Any] = {}
        """Its last line, where it has one."""
        self.marks: list[Mark] = []
        self.states = Spans()
        self.verdicts: list[tuple[float, str, dict[str, str]]] = []
        """Of each kit that was judged: when [s], on which tray, and what was said of each part by name."""
        self._points: list[tuple[float, float]] = []
        self._before: dict[str, bytes] = {}

    def take(self, message: RecordedMessage) -> None:
        """Take the next line, score or state."""
        if message.topic == EVENT:
            self._take_event(json_of(message.data), message.time / SECOND)
            return
        if self._before.get(message.topic) == message.data:
            return
        if message.topic == _STATE:
            self.states.add(message.time / SECOND, from_cdr(message.data, String).data)
        else:
            self._add_points(message.time / SECOND, from_cdr(message.data, Float32).data)
        self._before[message.topic] = message.data

    def score(self) -> ScoreTrack | None:
        """What had been earned when; None where nothing tells it."""
        if not self._points:
            return None
        best = self.about.get("reachable")
        times, points = (np.array(column) for column in zip(*self._points, strict=True))
        return ScoreTrack(times, points, float(best) if isinstance(best, (int, float)) else None)

    # ---------------------------------------------------------------- inside

    def _add_points(self, time: float, points: float) -> None:
        if not self._points or self._points[-1][1] != points:
            self._points.append((time, points))

    def _take_event(self, event: dict[str, Any], now: float) -> None:
        time = event.get("time")
        when = float(time) if isinstance(time, (int, float)) else now
        try:
            match event.get("kind"):
                case "run":
                    self.about = event
                case "order":
                    self.marks.append(Mark(when, str(event["order_id"])))
                case "kit":
                    self._take_kit(event, when)
                case "trial over":
                    self.marks.append(Mark(when, str(event["reason"])))
                case "result":
                    self.result = event
                case _:
                    pass
        except (KeyError, TypeError, AttributeError) as error:
            raise MessageError(f"a line of the log that lacks something: {error}") from None

    def _take_kit(self, event: dict[str, Any], when: float) -> None:
        tray = tray_name(str(event["tray_id"]))
        found = event["evidence"]
        if found is None:
            self.marks.append(Mark(when, f"{event['kit_type']} refused", tray))
            return
        self.marks.append(Mark(when, f"{found['kit_type']}: {found['total']:g} of {found['best']:g}", tray))
        verdicts = {str(part["object"]): "right" for part in found["parts"] if part["presence"] and part["object"]}
        for extra in found["extras"]:
            verdicts[str(extra["name"])] = "faulty" if extra["reason"] == "faulty" else "not ordered"
        self.verdicts.append((when, tray, verdicts))


def tray_name(link: str) -> str:
    """How a tray is called here, by its link or its number: `AGV 1`."""
    number = link.partition("::")[0].removeprefix("agv")
    return f"AGV {number}"
