"""Commands of a policy in a recording: whether each is that of the action that acts by the rules."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any, TypeAlias

from cellwright.cell.cell import Cell
from cellwright.clients.policies.report import ReportCheck, Rules
from cellwright.clients.policies.schedule import Chosen
from cellwright.config.control import Channel, ControlSpace
from cellwright.middleware.bus import InputKind
from cellwright.middleware.messages.standard import JointState, JointTrajectory
from cellwright.recording.format.commands import Command
from cellwright.robot.node import RobotNode
from cellwright.util.errors import CellwrightError, UsageError

_TOLERANCE = 1e-6  # [rad; m] of a target: inverse kinematics may round otherwise on another machine
_CHECKER = "/verification"

Places: TypeAlias = dict[str, dict[str, int]]
"""Place of each joint and gripper among the channels, by the topic of its commands and its name in them."""


class CommandCheck:
    """Check of the commands of an episode.

    Args:
        served: the cell of the recorded run, or the watched node of a robot.
        rules: the rules.
        begin: the command with the rules, of the first control instant.
    """

    def __init__(self, served: Cell | NodeWatch, rules: Rules, begin: Command) -> None:
        from cellwright.clients.client.client import Client
        from cellwright.clients.client.session import NodeClient
        from cellwright.clients.policies.cell_workplace import CellWorkplace
        from cellwright.clients.policies.key_map import default_map
        from cellwright.clients.policies.map_reader import map_of_text
        from cellwright.clients.policies.robot_workplace import RobotWorkplace
        from cellwright.clients.policies.targets import Targets

        place_of_work: CellWorkplace | RobotWorkplace
        if isinstance(served, Cell):
            place_of_work = CellWorkplace(Client.in_process(served))
        else:
            client = NodeClient.in_process(served.node, node=_CHECKER)
            place_of_work = RobotWorkplace(client, served.node.config, rules.timestep)
        names = place_of_work.names
        key_map = map_of_text(rules.map, names) if rules.map else default_map(names)
        commanded, channels = key_map.channels(names), names.space.channels
        self._targets = Targets(key_map, names.space, place_of_work.arms)
        self._begin, self._node = begin.tick, begin.node
        self._watch = None if isinstance(served, Cell) else served
        self._places = _places_of_cell(served, channels) if isinstance(served, Cell) else _places_of_node(channels)
        self._sends_always = self._watch is None or any(
            each.kind == "joint" and each.name in commanded for each in channels
        )
        self._unknown: set[int] = set()
        self._is_held = False
        self._wanted: list[float] = []
        self._instant, self._request = -1, 0
        self._start()

    def check(self, command: Command, reports: ReportCheck) -> None:
        """Check a command, if it is one of the policy for joints or for the grippers of a robot's node.

        Raises:
            CellwrightError: the action that acts makes another one.
        """
        if command.node != self._node or command.name not in self._places or command.kind is not InputKind.PUBLISH:
            return
        if (instant := command.tick - self._begin) != self._instant:
            acting = reports.action(instant)
            if acting is None:
                raise CellwrightError(
                    f"request {max(0, reports.requests - 1)}: no action acts at tick {instant} (got a command)"
                )
            if self._is_held:
                self._start()
            self._instant, (self._request, action) = instant, acting
            self._wanted = self._targets.take(action)
        for name, position in _positions(command.message()).items():
            place = self._places[command.name].get(name)
            if place is None:
                continue
            if place not in self._unknown and not abs(position - self._wanted[place]) <= _TOLERANCE:
                raise CellwrightError(
                    f"request {self._request}: {name} must go to {self._wanted[place]:.6g} at tick {instant} "
                    f"(got {position:.6g})"
                )
            self._unknown.discard(place)
            self._targets.values[place] = position

    def pass_silent(self, instant: int, chosen: Chosen) -> None:
        """Take note of an action that had no command at its instant.

        Raises:
            UsageError: it must have had one: a cell always takes commands, a robot's node while it is enabled, not
                stopped, and not on its way home.
        """
        takes = self._watch is None or self._watch.takes_commands(self._begin + instant)
        if takes and self._sends_always:
            raise UsageError(
                f"request {chosen.request}: action {chosen.place} must act at tick {instant} (got no command)"
            )
        self._is_held = self._is_held or not takes

    def _start(self) -> None:
        """Let steps go on from where all channels are now; those of a cell are known from its first commands."""
        self._is_held = False
        if self._watch is None:
            self._unknown = {place for places in self._places.values() for place in places.values()}
        else:
            self._targets.begin(self._watch.values())


class NodeWatch:
    """Watch of a robot's node by its messages, as a policy has it: where all channels are, and if commands are taken.

    Args:
        node: the node, before its time passes.
    """

    def __init__(self, node: RobotNode) -> None:
        from cellwright.clients.policies.robot_workplace import GRIPPERS, STATES, STATUS

        self.node = node
        self._states, self._closed = _Newest(), _Newest()
        self._taking: list[tuple[int, bool]] = []
        for topic, take in ((STATES, self._states.take), (GRIPPERS, self._closed.take), (STATUS, self._note)):
            node.bus.subscribe(topic, take, node=_CHECKER)

    def values(self) -> list[float]:
        """Return the newest value of each channel."""
        channels = ControlSpace.of_node(self.node.config).channels
        joints = [self._states.position(each.joint) for each in channels if each.kind == "joint"]
        return joints + [self._closed.position(f"gripper_{number}") for number in range(len(channels) - len(joints))]

    def takes_commands(self, tick: int) -> bool:
        """Return whether commands were taken at a tick for certain: all that the status said then."""
        before = [takes for at, takes in self._taking if at < tick][-1:]
        return all([*before, *(takes for at, takes in self._taking if at == tick)])

    def _note(self, status: Any) -> None:
        from cellwright.clients.policies.robot_workplace import takes_commands

        takes = takes_commands(status)
        if not self._taking or self._taking[-1][1] is not takes:
            self._taking.append((self.node.simulation.clock.tick, takes))


class _Newest:
    """Newest message of a topic with positions by name."""

    def __init__(self) -> None:
        self.take = partial(setattr, self, "message")
        self.message: Any = None

    def position(self, name: str) -> float:
        if self.message is None:
            raise UsageError(f"request 0: no message tells where {name} is")
        return float(self.message.position[self.message.name.index(name)])


def _places_of_cell(cell: Cell, channels: Sequence[Channel]) -> Places:
    """Return the places of joints; suction and widths are calls and goals, which are not compared."""
    spaces = {each.name: each.namespace for each in cell.trial.layout.robots}
    found: Places = {}
    for place, channel in enumerate(channels):
        if channel.kind == "joint":
            arm = f"/ariac/{channel.arm}".rstrip("/")
            topic = f"/{spaces[channel.robot]}/joint_cmd" if channel.robot else f"{arm}/arm/command"
            found.setdefault(topic, {})[channel.joint] = place
    return found


def _places_of_node(channels: Sequence[Channel]) -> Places:
    from cellwright.clients.operators.robot import GRIPPER_COMMAND, JOINT_COMMAND

    grippers = [place for place, each in enumerate(channels) if each.kind != "joint"]
    return {
        JOINT_COMMAND: {each.joint: place for place, each in enumerate(channels) if each.kind == "joint"},
        GRIPPER_COMMAND: {f"gripper_{number}": place for number, place in enumerate(grippers)},
    }


def _positions(message: Any) -> Mapping[str, float]:
    """Return the target of each joint in a message to an arm or a robot."""
    if isinstance(message, JointTrajectory) and message.points:
        return dict(zip(message.joint_names, message.points[0].positions, strict=False))
    return dict(zip(message.name, message.position, strict=False)) if isinstance(message, JointState) else {}
