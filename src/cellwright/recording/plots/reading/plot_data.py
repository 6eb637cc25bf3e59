"""Plot data of a recording, read in one pass."""

from collections.abc import Sequence
from contextlib import suppress
from itertools import islice
from typing import Any

from cellwright.config.layout.arms import MAX_ARMS
from cellwright.config.layout.robots import MAX_ROBOTS
from cellwright.config.ur10 import GRIPPER
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.plots.reading.cell import ArmStateReader, BodyPath, CompetitionReader, Trays
from cellwright.recording.plots.reading.reader import SECOND, CommandReader, GripperReader, TopicReader
from cellwright.recording.plots.reading.robot import About, JointStateReader, Status, Tips
from cellwright.recording.plots.tracks import JointTrack, PlotData, ToolTrack
from cellwright.util.errors import MessageError, RecordingError


def load_plot_data(recording: RecordingFile) -> PlotData:
    """Load the plot data of a recording; damaged messages are skipped."""
    return _robot(recording) if recording.header.kind == "robot" else _cell(recording)


class _Arm:
    """Readers of what concerns one arm.

    Args:
        name: its name.
        base: name that its topics begin with.
        path: reader of the path of its tool.
    """

    def __init__(self, name: str, base: str, path: BodyPath) -> None:
        self.state, self.gripper = ArmStateReader(f"{base}/arm/state"), GripperReader(f"{base}/gripper/state")
        self.name, self.path = name, path

    def tool(self, end: float, shown: str = "") -> ToolTrack:
        """Return the path of its tool until a time [s], under another name than the arm's if one is given."""
        on, attached = self.gripper.on.until(end), self.gripper.attached.until(end)
        return self.path.track(shown or self.name, on, attached, self.name)


class _Robot:
    """Readers of the joints of one robot of a cell.

    Args:
        namespace: namespace of its topics.
        sliding: names of its joints with positions in metres.
    """

    def __init__(self, namespace: str, sliding: Sequence[str]) -> None:
        self.measured, self.applied = (
            JointStateReader(f"/{namespace}/{topic}") for topic in ("joint_states", "applied_joint_cmd")
        )
        self._sliding = sliding

    def tracks(self) -> list[JointTrack]:
        """Return its joints."""
        targets = self.applied.curves()
        return [
            JointTrack(name, "m" if name in self._sliding else "rad", *curve, *targets.get(name, ()))
            for name, curve in self.measured.curves().items()
        ]


def _cell(recording: RecordingFile) -> PlotData:
    robots = _robots(recording)
    of_robots = [reader for robot in robots.values() for reader in (robot.measured, robot.applied)]
    arms = {name: _Arm(name, base, BodyPath(recording.scene, link)) for name, (base, link) in _arms(recording).items()}
    trays, competition, commands = Trays(), CompetitionReader(), CommandReader()
    of_arms = [reader for arm in arms.values() for reader in (arm.state, arm.gripper, arm.path)]
    warning = _read(recording, (*of_arms, *of_robots, trays, competition, commands))
    end = recording.end_time / SECOND
    alone = "vacuum gripper" if len(arms) == 1 else ""
    tools = [arm.tool(end, alone) for arm in arms.values()]
    joints = {name[:1].upper() + name[1:]: arm.state.tracks() for name, arm in arms.items()}
    joints |= {name[:1].upper() + name[1:]: robot.tracks() for name, robot in robots.items()}
    states = competition.states.until(end)
    return PlotData(
        title=recording.header.name,
        note=_note(recording, {**recording.header.facts, **competition.about}, competition),
        begin=recording.begin / SECOND,
        end=end,
        joints={name: tracks for name, tracks in joints.items() if tracks},
        tools=[tool for tool in tools if len(tool.times)],
        trays=trays.names,
        tray_parts=trays.parts(end, competition.verdicts),
        score=competition.score(),
        marks=competition.marks,
        collisions=competition.collisions,
        states={"competition": states} if states else {},
        commands=commands.tracks(),
        warning=warning,
    )


def _arms(recording: RecordingFile) -> dict[str, tuple[str, str]]:
    """Return the beginning of the topics of each arm by its name, and the link of its tool; 2017's arm by default."""
    try:
        found = {
            str(name): ("/".join(filter(None, ("/ariac", each["namespace"]))), str(each["tool"]))
            for name, each in recording.header.facts["arms"].items()
        }
    except (AttributeError, KeyError, TypeError):
        return {"arm": ("/ariac", GRIPPER)}
    return dict(islice(found.items(), MAX_ARMS))


def _robots(recording: RecordingFile) -> dict[str, _Robot]:
    """Return the readers of the robots of a cell, by their names."""
    try:
        found = {
            str(name): _Robot(str(each["namespace"]), [str(joint) for joint in each["sliding"]])
            for name, each in recording.header.facts["robots"].items()
        }
    except (AttributeError, KeyError, TypeError):
        return {}
    return dict(islice(found.items(), MAX_ROBOTS))


def _robot(recording: RecordingFile) -> PlotData:
    measured, applied = JointStateReader("/io_teleop/joint_states"), JointStateReader("/io_teleop/applied_joint_cmd")
    grippers, tips, status = JointStateReader("/io_teleop/gripper_states"), Tips(), Status()
    about, commands = About(), CommandReader()
    warning = _read(recording, (measured, applied, grippers, tips, status, about, commands))
    end = recording.end_time / SECOND
    actual, targets, units = measured.curves(), applied.curves(), about.units()
    joints = {
        name: JointTrack(name, units.get(name, "rad"), *curve, *targets.get(name, ())) for name, curve in actual.items()
    }
    groups = {
        group[:1].upper() + group[1:]: [joints[name] for name in names if name in joints]
        for group, names in (about.groups() or {"joints": list(joints)}).items()
    }
    sides = about.grippers()
    closed = [
        JointTrack(f"{sides[number]} gripper".strip() if number < len(sides) else name, "closed 0..1", *curve)
        for number, (name, curve) in enumerate(grippers.curves().items())  # the topic only numbers them
    ]
    states = {"safety": status.safety.until(end), "commands of": status.commander.until(end)}
    return PlotData(
        title=recording.header.name,
        note=_note(recording, recording.header.facts),
        begin=recording.begin / SECOND,
        end=end,
        joints={name: tracks for name, tracks in {**groups, "Grippers": closed}.items() if tracks},
        tools=tips.tracks(about.arms()),
        states={name: spans for name, spans in states.items() if spans},
        commands=commands.tracks(),
        warning=warning,
    )


def _read(recording: RecordingFile, readers: Sequence[TopicReader]) -> str:
    """Pass each message to the readers of its topic; return what is wrong with the recording, if anything."""
    by_topic: dict[str, list[TopicReader]] = {}
    for reader in readers:
        for topic in reader.topics:
            by_topic.setdefault(topic, []).append(reader)
    try:
        for message in recording.messages(by_topic):
            for reader in by_topic[message.topic]:
                with suppress(MessageError):
                    reader.take(message)
    except RecordingError as error:
        return f"{error}; plotted as far as it can be read"
    return "" if recording.is_complete else f"{recording.path}: cut short; plotted as far as it goes"


def _note(recording: RecordingFile, facts: Any, competition: CompetitionReader | None = None) -> str:
    """Return the line below the title: agent, seed, score and duration."""
    words = [str(facts["agent"])] if facts.get("agent") else []
    if facts.get("seed") is not None:
        words.append(f"seed {facts['seed']}")
    if competition is not None and (score := competition.score()) is not None:
        best = competition.about.get("best")
        of = f" of {best:g}" if isinstance(best, (int, float)) else ""
        words.append(f"{score.points[-1]:g}{of} points")
    words.append(f"{(recording.end_time - recording.begin) / SECOND:.1f} s")
    outcome = competition.result.get("outcome") if competition is not None else None
    words += [str(outcome)] if outcome else []
    words += [] if recording.is_complete else ["cut short"]
    return "   ".join(words)
