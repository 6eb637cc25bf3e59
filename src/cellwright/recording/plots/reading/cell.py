"""Readers of a cell's plot data: arm, path of a body, referee's log and score, parts on trays."""

from typing import Any

import numpy as np

from cellwright.middleware.messages import from_cdr
from cellwright.middleware.messages.control_msgs import JointTrajectoryControllerState
from cellwright.middleware.messages.standard import Float32, String
from cellwright.recording.format.format import EVENT, FRAME, PANEL
from cellwright.recording.format.reader import RecordedMessage, frame_bytes, json_object
from cellwright.recording.plots.reading.reader import SECOND, Spans
from cellwright.recording.plots.tracks import JointTrack, Mark, ScoreTrack, Span, ToolTrack, TrayPart
from cellwright.rendering.scene.scene import Frame, decode_frame, decode_scene
from cellwright.util.errors import MessageError, showable

_SLIDES = "linear"  # in the names of joints that slide


class Arm:
    """Reads /ariac/arm/state."""

    topics = ("/ariac/arm/state",)

    def __init__(self) -> None:
        self._names: tuple[str, ...] = ()
        self._rows: list[tuple[float, list[float], list[float]]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next state."""
        state = from_cdr(message.data, JointTrajectoryControllerState)
        names = tuple(state.joint_names)
        wanted, seen = (list(point.positions) for point in (state.desired, state.actual))
        self._names = self._names or names
        if names == self._names and len(wanted) == len(seen) == len(names):
            self._rows.append((message.time / SECOND, seen, wanted))

    def tracks(self) -> list[JointTrack]:
        """The joints."""
        if not self._rows:
            return []
        times = np.array([time for time, _, _ in self._rows])
        seen, wanted = (np.array([row[place] for row in self._rows]) for place in (1, 2))
        return [
            JointTrack(_joint_name(name), "m" if _SLIDES in name else "rad", times, seen[:, n], times, wanted[:, n])
            for n, name in enumerate(self._names)
        ]


def _joint_name(name: str) -> str:
    """A joint's name as one says it: `shoulder_pan_joint` is the shoulder pan."""
    return "rail" if name.startswith("linear_arm") else name.removesuffix("_joint").replace("_", " ")


class BodyPath:
    """Reads the path of one body, by its name in the encoded scene."""

    topics = (FRAME,)

    def __init__(self, scene: bytes | None, body: str) -> None:
        try:
            bodies = () if scene is None else decode_scene(scene).bodies
        except MessageError:
            bodies = ()
        self._body = bodies.index(body) if body in bodies else -1
        self._frame: Frame | None = None
        self._rows: list[tuple[float, float, float, float]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take the next frame."""
        if self._body < 0:
            return
        self._frame = decode_frame(frame_bytes(message.data), self._frame)
        if self._body < len(self._frame.poses):
            x, y, z = self._frame.poses[self._body, :3].tolist()
            self._rows.append((message.time / SECOND, x, y, z))

    def track(self, name: str, on: list[Span], attached: list[Span]) -> ToolTrack:
        """The path, under a name."""
        rows = np.array(self._rows).reshape(-1, 4)
        return ToolTrack(name, "world", rows[:, 0], rows[:, 1:], on, attached)


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
            self._take_event(json_object(message.data), message.time / SECOND)
            return
        if self._before.get(message.topic) == message.data:
            return
        if message.topic == _STATE:
            self.states.add(message.time / SECOND, from_cdr(message.data, String).data)
        else:
            self._points.append((message.time / SECOND, from_cdr(message.data, Float32).data))
        self._before[message.topic] = message.data

    def score(self) -> ScoreTrack | None:
        """What had been earned when; None where nothing tells it."""
        if not self._points:
            return None
        best = self.about.get("reachable")
        times, points = (np.array(column) for column in zip(*self._points, strict=True))
        return ScoreTrack(times, points, float(best) if isinstance(best, (int, float)) else None)

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


_LONGEST = 200  # characters of a name
_LATE = 1.5  # a part that was judged may have been reported last so long before [s]


class Trays:
    """Reads which part was on which tray, from when until when."""

    topics = (PANEL,)

    def __init__(self) -> None:
        self.names: list[str] = []
        self._since: dict[tuple[str, str], float] = {}
        self._faulty: set[str] = set()
        self._gone: list[tuple[str, str, float, float]] = []

    def take(self, message: RecordedMessage) -> None:
        """Take what the panel shows next."""
        panel = json_object(message.data)
        try:
            trays = {tray_name(str(tray["number"])): _parts_on_tray(tray) for tray in panel.get("trays", ())}
        except (KeyError, TypeError, AttributeError) as error:
            raise MessageError(f"a panel that lacks something: {error}") from None
        now = message.time / SECOND
        self.names += [name for name in trays if name not in self.names]
        there = {(tray, part) for tray, parts in trays.items() for part in parts}
        self._faulty |= {part for parts in trays.values() for part, is_faulty in parts.items() if is_faulty}
        for each in [each for each in self._since if each not in there]:
            self._gone.append((*each, self._since.pop(each), now))
        for each in sorted(there - self._since.keys()):
            self._since[each] = now

    def parts(self, end: float, verdicts: list[tuple[float, str, dict[str, str]]]) -> list[TrayPart]:
        """All parts that lay on trays up to the end [s]; `verdicts` as in `Competition`."""
        spans = [*self._gone, *((*each, since, end) for each, since in self._since.items())]
        found = []
        for tray, name, begin, over in sorted(spans, key=lambda span: (span[2], span[1])):
            said = "faulty" if name in self._faulty else ""
            for when, where, words in verdicts:
                if where == tray and begin <= when <= over + _LATE:
                    said = words.get(name, said)
            found.append(TrayPart(tray, _part_name(name), begin, over, said))
        return found


def _parts_on_tray(tray: dict[str, Any]) -> dict[str, bool]:
    """The parts on a tray by name, and whether they are known to be faulty."""
    return {str(part["name"]): bool(part.get("faulty")) for part in tray["parts"]}


def _part_name(name: str) -> str:
    """A part's name as one says it: `bin7|piston_rod_part_9` is piston rod 9 of bin 7."""
    place, _, rest = showable(name, _LONGEST).rpartition("|")
    words = rest.replace("_part", "").replace("_clone", "").replace("_", " ")
    return f"{words} ({'belt' if 'conveyor' in place else place})" if place else words
