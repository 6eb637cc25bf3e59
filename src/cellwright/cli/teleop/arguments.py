"""Options of `cellwright teleop`."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from cellwright.cli import options
from cellwright.cli.arguments import (
    LOCKSTEP_HELP,
    NETWORK,
    OUTPUT,
    ROBOT_HELP,
    SIMULATION,
    SPEED_HELP,
    AsJson,
    NetworkArguments,
    PageArguments,
    Record,
    Until,
    VideoArguments,
    XacroArguments,
)
from cellwright.cli.parameters import argument, flag, option
from cellwright.cli.policies import PANEL, PolicyArguments
from cellwright.clients.policies.spec import RECORDING
from cellwright.robot.interface import NODE
from cellwright.robot.safety import RESUME_SPEED, Guard, SafetySettings
from cellwright.robot.servos import Motion
from cellwright.running.run.observers import RobotWindow

_SAFETY = "Safety"
"""Heading for options in the help."""


@dataclass(frozen=True)
class SafetyArguments:
    """Options of the safety of a robot's node."""

    start_disabled: Annotated[
        bool,
        flag("--start-disabled", "Take no commands until the service /io_teleop/set_enabled enables them.", _SAFETY),
    ] = False
    watchdog: Annotated[
        float | None,
        option("S", "Hold the joints that a topic moves after this silence on it [s], such as 0.5.", _SAFETY),
    ] = None
    max_speed: Annotated[
        list[str] | None,
        option(
            "[JOINTS=]V",
            "Limit the speed of targets [rad/s; m/s]; `J_arm_*=1.5` for the joints that match. Repeatable; the last "
            "match counts.",
            _SAFETY,
        ),
    ] = None
    start_guard: Annotated[
        float | None,
        option("D", "Maximum distance of a first target from the joint's position [rad; m], such as 0.8.", _SAFETY),
    ] = None
    guard: Annotated[
        Guard,
        option(
            "ACTION",
            "Action for a first target farther away: `refuse`, or `blend` (go there slowly).",
            _SAFETY,
            name="--start-guard-then",
        ),
    ] = Guard.REFUSE
    resume_speed: Annotated[
        float, option("V", "Speed of the first approach after a stop, a silence or a blend [rad/s; m/s].", _SAFETY)
    ] = RESUME_SPEED
    command_topic: Annotated[
        list[str] | None,
        option(
            "TOPIC",
            "Topic that commands the robot, such as `joint_cmd`; others are ignored. Repeatable. Default: all.",
            _SAFETY,
        ),
    ] = None
    one_commander: Annotated[
        float | None,
        option("S", "Take a topic from one node only, until that node has been silent this long [s].", _SAFETY),
    ] = None
    max_age: Annotated[
        float | None,
        option(
            "S", "Refuse commands older than this by their stamp [s], or stamped earlier than the one before.", _SAFETY
        ),
    ] = None
    tip_speed: Annotated[
        float | None, option("V", "Speed of arm tips towards target poses [m/s]. Default: 2.", _SAFETY)
    ] = None
    tip_turning: Annotated[
        float | None,
        option("W", "Angular speed of arm tips towards target poses [rad/s]. Default: one turn per second.", _SAFETY),
    ] = None
    clutch: Annotated[
        bool,
        flag("--clutch", "Apply targets relative to the first target and the joint positions at that time.", _SAFETY),
    ] = False

    def settings(self) -> SafetySettings:
        """Return the settings of the node."""
        if self.guard is not Guard.REFUSE and self.start_guard is None:
            options.refuse(f"--start-guard-then {self.guard} requires --start-guard (for example --start-guard 0.8)")
        return SafetySettings(
            start_disabled=self.start_disabled,
            silence=self.watchdog,
            max_speeds=tuple(map(options.joint_speed, self.max_speed or ())),
            start_guard=self.start_guard,
            guard=self.guard,
            resume_speed=self.resume_speed,
            one_commander=self.one_commander,
            max_age=self.max_age,
            tip_speed=self.tip_speed,
            tip_turning=self.tip_turning,
            clutch=self.clutch,
            command_topics=tuple(
                name if name.startswith("/") else f"/io_teleop/{name}" for name in self.command_topic or ()
            ),
        )


@dataclass(frozen=True, kw_only=True)
class TeleopArguments:
    """Arguments and options of `cellwright teleop`, in the order of its help."""

    robot: Annotated[str, argument("ROBOT", ROBOT_HELP)]
    xacro_arguments: XacroArguments = None
    motion: Annotated[
        Motion, option("LAW", "`servo`: within the URDF's speeds and efforts; `teleport`: at once.", SIMULATION)
    ] = Motion.SERVO
    rate: Annotated[str, option("HZ", "Physics steps per second.", SIMULATION)] = "240"
    self_collision: Annotated[
        bool, flag("--self-collision", "Let the robot's links collide with each other.", SIMULATION)
    ] = False
    check: Annotated[
        bool,
        flag(
            "--check",
            "Check the robot's motion, against its recorded motion or else joint by joint, and stop.",
            SIMULATION,
        ),
    ] = False
    sim_time: Annotated[
        bool, flag("--sim-time", "Publish simulation time on /clock, and stamp messages with it.", SIMULATION)
    ] = False
    speed: Annotated[
        str | None, option("FACTOR", f"{SPEED_HELP} Values other than `1` require --sim-time or --policy.", SIMULATION)
    ] = None
    lockstep: Annotated[bool, flag("--lockstep", f"{LOCKSTEP_HELP}; implies --sim-time.", SIMULATION)] = False
    safety: SafetyArguments
    policy: PolicyArguments
    seed: Annotated[
        int | None, option("N", "Seed of the policy, and of drawn latencies. Default: 0.", PANEL, name="--seed")
    ] = None
    driver: Annotated[
        str | None,
        option(
            "FILE.py:CLASS",
            "Move your own robot by your own driver; nothing is simulated.",
            SIMULATION,
            name="--driver",
        ),
    ] = None
    check_driver: Annotated[
        bool,
        flag(
            "--check-driver",
            "Move each joint of that robot by 0.02 and back, print the errors of its driver, and stop.",
            SIMULATION,
        ),
    ] = False
    until: Until = None
    network: NetworkArguments
    gui: Annotated[bool, flag("--gui", "Show the robot in MuJoCo's window.", OUTPUT)] = False
    init_debug: Annotated[
        bool, flag("--init-debug", "Show it in MuJoCo's window with a slider for each joint, under `Control`.", OUTPUT)
    ] = False
    snapshot: Annotated[Path | None, option("FILE.png", "Write a picture of the robot at the end.", OUTPUT)] = None
    ros2_control: Annotated[
        bool,
        flag(
            "--ros2-control",
            "Print a xacro file with which ros2_control, and so MoveIt, drives this robot over its topics, and stop.",
            NETWORK,
        ),
    ] = False
    node: Annotated[str, option("NAME", "Name of the node in ROS.", NETWORK, name="--node")] = NODE
    page: PageArguments
    record: Record = None
    video: VideoArguments
    as_json: AsJson = False
    verbose: Annotated[bool, flag("--verbose -v", "Print more in the summary.", OUTPUT)] = False

    @property
    def has_policy(self) -> bool:
        """True if a policy drives the robot."""
        return self.policy.policy is not None

    @property
    def has_sim_time(self) -> bool:
        """True if the node publishes simulation time."""
        return self.sim_time or self.lockstep or self.has_policy

    def factor(self) -> float | None:
        """Return the real-time factor; None for as fast as possible."""
        default = "max" if self.lockstep or self.has_policy else "1"
        return options.speed(default if self.speed is None else self.speed)

    def window(self) -> RobotWindow:
        """Return the window and the picture at the end."""
        snapshot = options.output_file("--snapshot", self.snapshot, ".png")
        return RobotWindow(self.gui or self.init_debug, self.init_debug, snapshot)

    def refuse(self) -> None:
        """Refuse options that do not go together."""
        if self.factor() != 1.0 and not self.has_sim_time:
            options.refuse(f"--speed {self.speed} requires --sim-time")
        if self.seed is not None:
            if not self.has_policy:
                options.refuse("--seed requires --policy, such as --policy ws://127.0.0.1:8000")
            if self.policy.policy and self.policy.policy.endswith(RECORDING):
                options.refuse(f"--policy {self.policy.policy}: the recording has its own seed; leave out --seed")
            options.in_range("--seed", self.seed, 0, options.MAX_SEED, "a whole number from 0 to 2**63 - 1")
        if self.has_policy and self.lockstep:
            options.refuse("--policy lets time stand while the policy answers; leave out --lockstep")
        if self.has_policy and self.driver is not None:
            options.refuse("--driver: a real robot does not stand while a policy answers; leave out --policy")
        if self.driver is not None and self.has_sim_time:
            options.refuse("--driver: a real robot runs in real time; leave out --sim-time and --lockstep")
        if self.driver is not None and not self.check_driver:
            given = {"--motion teleport": self.motion is not Motion.SERVO, "--self-collision": self.self_collision}
            if simulated := [option for option, is_given in given.items() if is_given]:
                options.refuse(f"--driver simulates nothing; leave out {' and '.join(simulated)}")
        is_limited = self.safety.settings() != SafetySettings()
        if self.check_driver:
            if self.check:
                options.refuse("--check and --check-driver: give one of them")
            if is_limited:
                options.refuse("--check-driver sends targets to the driver directly; leave out the safety options")
            if self.driver is None:
                options.refuse("--check-driver requires --driver (for example --driver my_driver.py:MyDriver)")
        if self.check:
            self._refuse_node_options(is_limited=is_limited)

    def _refuse_node_options(self, *, is_limited: bool) -> None:
        """Refuse options that need a node that keeps running."""
        given = {
            "--until": self.until is not None,
            "--lockstep": self.lockstep,
            "--sim-time": self.sim_time,
            "--speed": self.factor() != 1.0,
            "--driver": self.driver is not None,
            "--policy": self.has_policy,
            "--ros1": self.network.ros1,
            "--ros2": self.network.ros2,
            "--record": bool(self.record),
            "--video": self.video.video is not None,
            "--view": self.page.view,
            "--gui, --init-debug and --snapshot": self.gui or self.init_debug or self.snapshot is not None,
        }
        for name, is_given in given.items():
            if is_given:
                options.refuse(f"--check cannot be combined with {name}")
        if is_limited:
            hint = "measure a limited node with cellwright operate signal JOINT"
            options.refuse(f"--check cannot be combined with the safety options; {hint}")
