"""Readers of a cell's plot data: arm, path of a body, referee's log and score, parts on trays."""

import math
from typing import Any

import numpy as np

from cellwright.config.layout.arm_models import RAIL_JOINT
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.control_msgs import JointTrajectoryControllerState
from cellwright.middleware.messages.standard import Float32, String
from cellwright.recording.format.format import EVENT, FRAME, PANEL
from cellwright.recording.format.reader import RecordedMessage, frame_bytes, json_object
from cellwright.recording.plots.reading.reader import SECOND, Spans
from cellwright.recording.plots.tracks import (
    CollisionSpan,
    JointTrack,
    Mark,
    ScoreTrack,
    Span,
    ToolTrack,
    TrackedTrayPart,
)
from cellwright.rendering.scene.scene import SceneFrame, decode_frame, decode_scene
from cellwright.util.errors import MessageError, printable

_RAILS = ("linear_arm_actuator_joint", RAIL_JOINT)  # ends of the names of joints of rails
_SCORE, _STATE = "/ariac/current_score", "/ariac/competition_state"
_MAX_NAME_LENGTH = 200  # characters of a name
_LATE = 1.5  # [s] before its judgement, at most, a part was reported for the last time


class ArmStateReader:
    """Reader of the state of an arm's controller."""

    def __init__(self, topic: str) -> None:
        self.topics = (topic,)
        self._names: tuple[str, ...] = ()
        self._rows: list[tuple[float, list[float], list[float]]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next state."""
        state = TYPES.from_cdr(message.data, JointTrajectoryControllerState)
        names = tuple(state.joint_names)
        desired, actual = (list(point.positions) for point in (state.desired, state.actual))
        self._names = self._names or names
        if names == self._names and len(desired) == len(actual) == len(names):
            self._rows.append((message.time / SECOND, actual, desired))

    def tracks(self) -> list[JointTrack]:
        """Return the joints."""
        if not self._rows:
            return []
        times = np.array([time for time, _, _ in self._rows])
        actual, desired = (np.array([row[place] for row in self._rows]) for place in (1, 2))
        return [
            JointTrack(
                _joint_name(name), "m" if name.endswith(_RAILS) else "rad", times, actual[:, n], times, desired[:, n]
            )
            for n, name in enumerate(self._names)
        ]


def _joint_name(name: str) -> str:
    """Return the readable name of a joint: `shoulder_pan_joint` is "shoulder pan"."""
    return "rail" if name.endswith(_RAILS) else name.removesuffix("_joint").replace("_", " ")


class BodyPath:
    """Reader of the path of one body, by its name in the encoded scene."""

    topics = (FRAME,)

    def __init__(self, scene: bytes | None, body: str) -> None:
        try:
            bodies = () if scene is None else decode_scene(scene).bodies
        except MessageError:
            bodies = ()
        self._body = bodies.index(body) if body in bodies else -1
        self._frame: SceneFrame | None = None
        self._rows: list[tuple[float, float, float, float]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next frame."""
        if self._body < 0:
            return
        self._frame = decode_frame(frame_bytes(message.data), self._frame)
        if self._body < len(self._frame.poses):
            x, y, z = self._frame.poses[self._body, :3].tolist()
            self._rows.append((message.time / SECOND, x, y, z))

    def track(self, name: str, on: list[Span], attached: list[Span], arm: str = "") -> ToolTrack:
        """Return the path, under a name, of the tool of an arm."""
        rows = np.array(self._rows).reshape(-1, 4)
        return ToolTrack(name, "world", rows[:, 0], rows[:, 1:], on, attached, arm)


class CompetitionReader:
    """Reader of the referee's log, the score and the competition state."""

    topics = (EVENT, _SCORE, _STATE)

    def __init__(self) -> None:
        self.about: dict[str, Any] = {}
        """The first line of the log: trial, agent, seed."""
        self.result: dict[str, Any] = {}
        """The last line of the log; empty without one."""
        self.marks: list[Mark] = []
        self.collisions: list[CollisionSpan] = []
        self.states = Spans()
        self.verdicts: list[tuple[float, str, dict[str, str]]] = []
        """Of each judged kit: time [s], tray, and verdict of each part by name."""
        self._best: float | None = None
        self._began = 0.0
        self._total: tuple[float, float] | None = None
        self._samples: list[tuple[float, float]] = []
        self._kits: list[tuple[float, float]] = []
        self._before: dict[str, bytes] = {}

    def take(self, message: RecordedMessage) -> None:
        """Take the next line, score or state."""
        if message.topic == EVENT:
            self._take_event(json_object(message.data), message.time / SECOND)
            return
        if self._before.get(message.topic) == message.data:
            return
        if message.topic == _STATE:
            self.states.add(message.time / SECOND, TYPES.from_cdr(message.data, String).data)
        else:
            self._samples.append((message.time / SECOND, TYPES.from_cdr(message.data, Float32).data))
        self._before[message.topic] = message.data

    def score(self) -> ScoreTrack | None:
        """Return the score over time; None if the recording has none.

        The log has each kit, and the result; the topic is sampled, and a run may end before the next sample.
        """
        found = self._logged() if self.about else self._samples
        if not found:
            return None
        times, points = (np.array(column) for column in zip(*found, strict=True))
        return ScoreTrack(times, points, self._best)

    def _logged(self) -> list[tuple[float, float]]:
        """Return times [s] and points by the log; a run from a checkpoint begins with the points of the topic."""
        # The log of a run from a checkpoint has no kits from before it; the topic has their points.
        began, before = min(self._samples, default=(0.0, 0.0))
        points = [(self._began, 0.0 if self._kits and began >= self._kits[0][0] else before)]
        for time, total in self._kits:
            points.append((time, points[-1][1] + total))
        if self._total is not None and self._total[1] != points[-1][1]:
            points.append(self._total)
        return points

    def _take_event(self, event: dict[str, Any], now: float) -> None:
        try:
            when = _finite(event["time"]) if "time" in event else now
            match event.get("kind"):
                case "run":
                    self.about, self._began = event, when
                    self._best = _finite(event["reachable"]) if "reachable" in event else None
                case "state":
                    self.states.add(when, str(event["state"]))
                case "order":
                    self.marks.append(Mark(when, str(event["order_id"])))
                case "kit":
                    self._take_kit(event, when)
                case "collision":
                    link = str(event["link"]).removesuffix("_link").replace("_", " ")
                    begin, end = _finite(event["begin"]), _finite(event["end"])
                    label, owner = f"{link} / {event['obstacle']}", str(event.get("owner", ""))
                    self.collisions.append(CollisionSpan(begin, end, label, owner))
                case "trial over":
                    self.marks.append(Mark(when, str(event["reason"])))
                case "result":
                    self.result = event
                    if "score" in event:
                        self._total = when, _finite(event["score"]["total"])
                case _:
                    pass
        except (KeyError, TypeError, ValueError, OverflowError, AttributeError) as error:
            raise MessageError(f"incomplete line of the log: {error}") from None

    def _take_kit(self, event: dict[str, Any], when: float) -> None:
        tray = tray_name(str(event["tray_id"]))
        found = event["evidence"]
        if found is None:
            self.marks.append(Mark(when, f"{event['kit_type']} refused", tray))
            return
        self.marks.append(Mark(when, f"{found['kit_type']}: {found['total']:g} of {found['best']:g}", tray))
        if not event.get("repeated"):
            self._kits.append((when, _finite(found["total"])))
        verdicts = {str(part["object"]): "right" for part in found["parts"] if part["presence"] and part["object"]}
        for extra in found["extras"]:
            verdicts[str(extra["name"])] = "faulty" if extra["reason"] == "faulty" else "not ordered"
        self.verdicts.append((when, tray, verdicts))


def _finite(value: Any) -> float:
    """Return a number of the log; raise `ValueError` for any other value."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(f"points must be a number (got {value!r:.40})")
    return float(value)


def tray_name(link: str) -> str:
    """Return the readable name of a tray, from its link or its number: `AGV 1`, or the name of a fixed tray."""
    name = link.partition("::")[0]
    number = name.removeprefix("agv")
    return f"AGV {number}" if number.isdecimal() else name


class Trays:
    """Reader of the parts on trays, with times."""

    topics = (PANEL,)

    def __init__(self) -> None:
        self.names: list[str] = []
        self._since: dict[tuple[str, str], float] = {}
        self._faulty: set[str] = set()
        self._past: list[tuple[str, str, float, float]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next values of the panel."""
        panel = json_object(message.data)
        try:
            fixed = {tray["number"]: str(tray["name"]) for tray in panel.get("fixed_trays", ())}
            trays = {
                tray_name(fixed.get(tray["number"], str(tray["number"]))): _parts_on_tray(tray)
                for tray in panel.get("trays", ())
            }
        except (KeyError, TypeError, AttributeError) as error:
            raise MessageError(f"incomplete panel: {error}") from None
        now = message.time / SECOND
        self.names += [name for name in trays if name not in self.names]
        there = {(tray, part) for tray, parts in trays.items() for part in parts}
        self._faulty |= {part for parts in trays.values() for part, is_faulty in parts.items() if is_faulty}
        for each in [each for each in self._since if each not in there]:
            self._past.append((*each, self._since.pop(each), now))
        for each in sorted(there - self._since.keys()):
            self._since[each] = now

    def parts(self, end: float, verdicts: list[tuple[float, str, dict[str, str]]]) -> list[TrackedTrayPart]:
        """Return all parts that lay on trays up to the end [s]; `verdicts` as in `CompetitionReader`."""
        spans = [*self._past, *((*each, since, end) for each, since in self._since.items())]
        found = []
        for tray, name, begin, over in sorted(spans, key=lambda span: (span[2], span[1])):
            verdict = "faulty" if name in self._faulty else ""
            for when, verdict_tray, words in verdicts:
                if verdict_tray == tray and begin <= when <= over + _LATE:
                    verdict = words.get(name, verdict)
            found.append(TrackedTrayPart(tray, _part_name(name), begin, over, verdict))
        return found


def _parts_on_tray(tray: dict[str, Any]) -> dict[str, bool]:
    """Return the parts on a tray by name; True for those that are known to be faulty."""
    return {str(part["name"]): bool(part.get("faulty")) for part in tray["parts"]}


def _part_name(name: str) -> str:
    """Return the readable name of a part: `bin7|piston_rod_part_9` is "piston rod 9 (bin7)"."""
    place, _, rest = printable(name, _MAX_NAME_LENGTH).rpartition("|")
    words = rest.replace("_part", "").replace("_clone", "").replace("_", " ")
    return f"{words} ({'belt' if 'conveyor' in place else place})" if place else words
