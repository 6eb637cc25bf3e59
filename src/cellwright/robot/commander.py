"""Commander: the targets of all joints, emergency stop, enabling, and the watchdog of silent topics."""

from collections.abc import Callable, Iterable, Mapping

import numpy as np

from cellwright.config.robot.model import RobotModel
from cellwright.engine.device import Device, State
from cellwright.robot.drivers import Driver
from cellwright.robot.interface import JOINT_SOURCES, NAMESPACE, in_namespace
from cellwright.robot.limiter import NO_SOURCE, Numbers, TargetLimiter
from cellwright.robot.notices import Notices, RivalTopics
from cellwright.robot.safety import CommandGate, SafetySettings
from cellwright.robot.servos import Array, MimicJoints, fastest

CLEAR_STOP = "call /io_teleop/clear_emergency_stop to clear it"
"""Remedy for an emergency stop."""
ENABLE = "call /io_teleop/set_enabled to enable them"
"""Remedy for disabled commands."""
UNWATCHED_TOPICS = ("/io_teleop/target_gripper_status", "/io_teleop/target_base_move")
"""Topics on which one command may hold for long: their silence has no meaning."""


class Commander(Device):
    """Targets of all joints.

    Targets of commands pass the gate and become the desired positions. The applied positions follow within limits of
    position, speed and acceleration; the driver gets these. `max_accelerations` [rad/s^2; m/s^2] limits the
    acceleration of targets by joint; others are unlimited.

    Topics are those of a `namespace`.

    Attributes:
        sources: topics whose messages are joint targets, in the order of `JOINT_SOURCES`.
        numbers: number of each joint with one degree of freedom, by name.
        taken: number of accepted commands since the node started.
        ignored: number of commands that came while none was taken, or named no joint of the robot; the bus counts
            refused ones.
        why_held: reason for the last hold, in a sentence; empty while the robot follows commands.
    """

    def __init__(
        self,
        driver: Driver,
        robot: RobotModel,
        safety: SafetySettings,
        gate: CommandGate,
        notices: Notices,
        max_accelerations: Mapping[str, float],
        namespace: str = NAMESPACE,
    ) -> None:
        super().__init__("commander")
        self.sources = tuple(in_namespace(topic, namespace) for topic in JOINT_SOURCES)
        self.how_to_clear, self._how_to_enable = in_namespace(CLEAR_STOP, namespace), in_namespace(ENABLE, namespace)
        self.driver, self.gate, self.notices = driver, gate, notices
        self.numbers = {name: number for number, name in enumerate(driver.joints)}
        self.taken = self.ignored = 0
        self.on_hold: list[Callable[[], None]] = []
        """Called when all joints are held, and before they go home; autonomous motions must end then."""
        self.on_clear: list[Callable[[], None]] = []
        """Called when an emergency stop is cleared."""
        joints = [robot.joint(name) for name in driver.joints]
        limits = [joint.limits for joint in joints]
        self.limiter = TargetLimiter(
            driver.joints,
            np.array([each.lower for each in limits]),
            np.array([each.upper for each in limits]),
            np.array([fastest(joint) for joint in joints]),
            safety,
            np.array([max_accelerations.get(joint.name, np.inf) for joint in joints]),
        )
        self.mimics = MimicJoints(joints, self.limiter.lower, self.limiter.upper)
        self._safety = safety
        self._rivals = RivalTopics(driver.joints, self.sources, lambda: self.simulation.now, notices)
        self._seconds = 0.0
        self.watchdog = Watchdog(self, safety.silence)
        self.is_enabled = not safety.start_disabled
        self.is_stopped = self.is_homing = False
        self.why_held = ""
        self._ignored_for = ""  # reason why the newest commands were ignored

    def reset(self) -> None:
        """Hold the initial posture."""
        self._seconds = float(self.simulation.clock.timestep)
        self.limiter.begin(self.driver.read().positions)
        self.gate.forget()
        self.watchdog.forget()
        self._rivals.forget()
        self.is_enabled, self.is_stopped, self.is_homing = not self._safety.start_disabled, False, False
        self.why_held = ""
        if self._safety.start_disabled:
            # The first targets are approached slowly, as after any hold.
            self.limiter.hold(self.applied)

    @property
    def applied(self) -> Array:
        """Positions that the driver gets [rad; m]."""
        return self.limiter.applied

    @property
    def why_ignored(self) -> str:
        """Reason why commands are ignored now, and counted; empty if they are taken."""
        if self.is_stopped:
            return f"the emergency stop is active; {self.how_to_clear}"
        if not self.is_enabled:
            return f"commands are disabled; {self._how_to_enable}"
        return "the robot is on its way home" if self.is_homing else ""

    def admit(self, topic: str, node: str, stamp: int) -> bool:
        """Return whether a command may be carried out now; `confirm` must follow when it was.

        Args:
            topic: its topic.
            node: its sender.
            stamp: its stamp [ns]; 0 for none.

        Raises:
            RejectedCommandError: it is refused, for example because of its stamp.
        """
        chosen = self._safety.command_topics
        if chosen and topic not in chosen:
            self.ignored += 1
            line = f"{topic} does not command this robot, {' and '.join(chosen)} {'does' if len(chosen) == 1 else 'do'}"
            self.notices.log_once(f"not chosen {topic}", f"{line}; its messages are ignored (logged once)")
            return False
        why = self.why_ignored
        if why:
            self.ignored += 1
            if why != self._ignored_for:
                self.notices.log(f"ignoring {topic}{f' from {node}' if node else ''}: {why}")
        self._ignored_for = why
        if not why:
            self.gate.check(topic, node, stamp)
        return not why

    def confirm(self, topic: str, node: str, stamp: int) -> None:
        """Note an admitted command that was carried out; arguments as for `admit`."""
        self.gate.confirm(topic, node, stamp)
        self.taken += 1
        self.why_held = ""
        self.watchdog.note_command(topic, node)

    def follow(self, topic: str, joints: Numbers, positions: Array, *, guarded: bool = False) -> None:
        """Let joints, by number, follow a topic to positions [rad; m], clipped to their limits.

        Start guard and clutch apply to `guarded` positions only.

        Raises:
            RejectedCommandError: the start guard refuses it; nothing was changed.
        """
        source = self.sources.index(topic)
        before = self.limiter.source[joints]
        beyond = self.limiter.follow(source, joints, positions, self.measured, guarded=guarded)
        if np.count_nonzero(before != source):
            self._rivals.note(source, joints, before)
        if len(beyond):
            names, lower, upper = self.driver.joints, self.limiter.lower, self.limiter.upper
            requested = dict(zip(joints.tolist(), positions, strict=True))
            self.notices.log_limits(
                topic, [(names[each], requested[each], lower[each], upper[each]) for each in beyond.tolist()]
            )

    def set_targets(self, joints: Iterable[int], positions: Iterable[float]) -> None:
        """Move joints, by number, to positions [rad; m] on request of the node's own program."""
        if self.why_ignored:
            self.ignored += 1
            return
        self.limiter.lead(np.fromiter(joints, dtype=np.intp), np.fromiter(positions, dtype=np.float64))
        self.taken += 1

    def is_source_of(self, topic: str, joints: Iterable[int]) -> bool:
        """Return True if these joints follow a topic: no other has commanded them since, and none was held."""
        return bool((self.limiter.source[list(joints)] == self.sources.index(topic)).all())

    def hold_until_commanded(self) -> None:
        """Hold the robot's current position, as long as there was no command."""
        self.limiter.hold_until_commanded(self.measured())

    def hold(self, why: str) -> None:
        """Hold all joints where they are; earlier targets are discarded, so that nothing jumps afterwards."""
        self.limiter.hold(self.measured())
        self.watchdog.forget()
        self.is_homing = False
        self.why_held = why
        for end in self.on_hold:
            end()

    def stop(self, why: str) -> None:
        """Emergency stop: hold at once, and take no command until it is cleared."""
        if not self.is_stopped:
            self.is_stopped = True
            self.hold(why)
            self.notices.log(f"{why}; {self.how_to_clear}")

    def clear_stop(self) -> None:
        """End an emergency stop: the robot holds until the next command."""
        self.is_stopped = False
        self.why_held = "stop cleared; the robot holds until the next command"
        for begin in self.on_clear:
            begin()

    def set_enabled(self, enabled: bool) -> None:  # noqa: FBT001
        """Take commands, or hold and take none."""
        if self.is_enabled and not enabled:
            self.hold("commands are disabled")
        elif enabled and not self.is_enabled:
            self.why_held = ""
        self.is_enabled = enabled

    def begin_homing(self, joints: Numbers, positions: Array) -> None:
        """Move joints to positions [rad; m], and take no command meanwhile."""
        for end in self.on_hold:
            end()
        self.limiter.release()
        self.limiter.lead(joints, positions)
        self.watchdog.forget()
        self.is_homing, self.why_held = True, ""

    def end_homing(self) -> None:
        """Take commands again: the robot is home."""
        self.limiter.release()
        self.is_homing = False

    def before_step(self) -> None:
        """Give the driver the applied positions of this step."""
        self.watchdog.check()
        limiter, mimics = self.limiter, self.mimics
        if limiter.advance(self._seconds):
            if mimics.leaders:
                # Followers obey the limited leaders, so that both agree while a leader is slowed down.
                places = mimics.places(limiter.applied)
                limiter.applied[mimics.followers] = limiter.desired[mimics.followers] = places
            self.driver.command(limiter.applied)

    def get_state(self) -> State:
        """Return targets, flags, and the state of gate and watchdog."""
        return {
            **self.limiter.get_state(),
            "gate": self.gate.get_state(),
            "silent": self.watchdog.get_state(),
            "enabled": self.is_enabled,
            "stopped": self.is_stopped,
            "homing": self.is_homing,
            "why held": self.why_held,
        }

    def set_state(self, state: State) -> None:
        """Restore what `get_state` returned."""
        self.limiter.set_state(state)
        self.gate.set_state(state["gate"])
        self.watchdog.set_state(state["silent"])
        self.is_enabled, self.is_stopped, self.is_homing = state["enabled"], state["stopped"], state["homing"]
        self.why_held = state["why held"]

    def measured(self) -> Array:
        """Return the positions of the joints [rad; m]."""
        return self.driver.read().positions


class Watchdog:
    """Watchdog: holds joints whose topic was silent for `silence` [s]; None: never."""

    def __init__(self, commander: Commander, silence: float | None) -> None:
        self._commander, self._silence = commander, silence
        self._silent: dict[str, list[int]] = {}  # silent topics, with the joints held for them

    @property
    def topics(self) -> tuple[str, ...]:
        """Silent topics with joints that are still held: no other source moves them."""
        source = self._commander.limiter.source
        return tuple(sorted(topic for topic, joints in self._silent.items() if (source[joints] == NO_SOURCE).any()))

    @property
    def is_all_silent(self) -> bool:
        """True if the robot holds because all topics have been silent for too long."""
        return bool(self.topics) and not (self._commander.limiter.source >= 0).any()

    def check(self) -> None:
        """Hold the joints of topics that have become silent."""
        if self._silence is None:
            return
        commander, limiter = self._commander, self._commander.limiter
        for number, (kind, topic) in enumerate(zip(JOINT_SOURCES, commander.sources, strict=True)):
            if kind in UNWATCHED_TOPICS or topic in self._silent or not commander.gate.is_silent(topic):
                continue
            joints: Numbers = np.flatnonzero(limiter.source == number)
            if len(joints):
                limiter.hold(commander.measured(), joints)
                self._silent[topic] = joints.tolist()
                commander.notices.log(f"no message on {topic} for {self._silence:g} s: its joints are held")

    def note_command(self, topic: str, node: str) -> None:
        """Note a command that was taken."""
        if topic in self._silent:
            del self._silent[topic]
            self._commander.notices.log(f"messages on {topic} again, from {node or 'a client'}")

    def forget(self) -> None:
        """Clear: all joints are held for another reason, or go home."""
        self._silent.clear()

    def get_state(self) -> dict[str, list[int]]:
        """Return the silent topics and their held joints, as JSON values."""
        return {topic: list(joints) for topic, joints in self._silent.items()}

    def set_state(self, state: Mapping[str, list[int]]) -> None:
        """Restore what `get_state` returned."""
        self._silent = {topic: list(joints) for topic, joints in state.items()}
