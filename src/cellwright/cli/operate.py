"""Commands of `cellwright operate`: driving a robot without a headset, over the public topics."""

import fnmatch
import json
import math
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.live import Live
from rich.progress import BarColumn, Progress, TextColumn

from cellwright.cli import options, output
from cellwright.cli.arguments import OUTPUT, AsJson
from cellwright.cli.main import DONE, NOT_DONE, argument, flag, option, ros_arguments
from cellwright.cli.output import echo, print_line, warn, write_result
from cellwright.cli.signals import stopped_by_signals
from cellwright.cli.tables import FOLD, RIGHT, FittedTable, print_table, table
from cellwright.clients.client.ros1_transport import Ros1Transport
from cellwright.clients.client.ros2_transport import Ros2Transport
from cellwright.clients.client.session import NodeClient
from cellwright.clients.client.socket_transport import SocketTransport
from cellwright.clients.operators import playback
from cellwright.clients.operators.exercise import Exercise, JointStepResponse, Wave, WaveShape, check_signal, exercise
from cellwright.clients.operators.keyboard import Jog, Keyboard
from cellwright.clients.operators.playback import JointRecorder, Targets, read_targets
from cellwright.clients.operators.plots import Curve, terminal_plot, tracking_svg
from cellwright.clients.operators.robot import (
    JOINT_STATES,
    Ask,
    JointLimits,
    Now,
    OperatedRobot,
    ServiceCaller,
    service_request,
)
from cellwright.clients.operators.terminal import TerminatedError, panel
from cellwright.clients.operators.terminal import keyboard as terminal_keyboard
from cellwright.config.robot.robots import bundled, load_robot
from cellwright.config.robot.urdf import read_urdf
from cellwright.engine.loop import StopCondition
from cellwright.middleware.ros1.host import installation
from cellwright.middleware.ros1.host.master import DEFAULT_URI, URI_VARIABLE, MasterClient
from cellwright.middleware.ros1.host.ros1 import node_name
from cellwright.middleware.server import DEFAULT_PORT
from cellwright.middleware.server.server import LOOPBACK
from cellwright.util.errors import CellwrightError, RunEndedError, UnknownNameError, UsageError

if TYPE_CHECKING:
    from cellwright.middleware.ros2.host.installation import Installation

PARAMETER = "robot_description"
WHERE, WHAT, RESULT = "Connection", "Motion", OUTPUT
"""Headings for options in the help."""
NODE = "/operator"
_NODE_TIMEOUT = 5.0  # [s] for a node to appear in ROS
_DESCRIPTION_TIMEOUT = 2.0  # [s] for a robot's description to arrive, which waits at its publisher
_PLOT_WIDTH, _PLOT_HEIGHT = 78, 10
_STOP_TIMEOUT = 2.0  # [s] that the report of a stop may take
_CHECK_PERIOD = 0.1  # [s] between two checks for a request to stop
_MIN_SLEEP = 0.001  # [s]: less than a step, and more than rounding can produce
_MAX_SILENCE = 2.0  # [s]; the end of a recording without new lines may come this much too late
APPLIED = "/io_teleop/applied_joint_cmd"


def described_limits(environment: Mapping[str, str]) -> JointLimits:
    """Return the limits of the robot at the ROS master of an environment; none if there is no readable one."""
    try:
        return read_limits(MasterClient(environment.get(URI_VARIABLE) or DEFAULT_URI).parameter(f"/{PARAMETER}"))
    except CellwrightError:  # driving a robot works without limits
        return JointLimits()


def published_limits(session: NodeClient) -> JointLimits:
    """Return the limits of the robot on the topic `robot_description` of ROS 2; none if there is no readable one."""
    if f"/{PARAMETER}" not in session.transport.topics():
        return JointLimits()
    message = session.latest(f"/{PARAMETER}").wait(_DESCRIPTION_TIMEOUT)
    return read_limits(getattr(message, "data", None))


def read_limits(text: object) -> JointLimits:
    """Return the limits in a URDF's text; none if it is no readable one."""
    if not isinstance(text, str):
        return JointLimits()
    try:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / f"{PARAMETER}.urdf"
            path.write_text(text, encoding="utf-8")
            robot = read_urdf(path, warn=lambda _line: None)
    except CellwrightError:  # driving a robot works without limits
        return JointLimits()
    return JointLimits.of(robot, PARAMETER)


Connect = Annotated[
    str | None, option("HOST:PORT", f"Address of the node's server. Default: {LOOPBACK}:{DEFAULT_PORT}.", WHERE)
]

OverRos1 = Annotated[bool, flag("--ros1", "Connect over ROS 1, at the master in ROS_MASTER_URI.", WHERE)]

OverRos2 = Annotated[
    bool,
    flag(
        "--ros2",
        "Connect over ROS 2, in the domain ROS_DOMAIN_ID. Arguments behind `--ros-args` are the operator node's own.",
        WHERE,
    ),
]

Node = Annotated[str, option("NAME", "Name of the operator node.", WHERE)]


Robot = Annotated[
    str | None,
    option(
        "ROBOT",
        "Robot description for the joint limits: a name, a robot configuration or a URDF. Default: that of the "
        "bundled robot, or `robot_description` in ROS.",
        WHERE,
    ),
]


def _find_ros2() -> "Installation":
    from cellwright.middleware.ros2.host.installation import find  # slow to load

    return find()


class NodeConnection:
    """Address of a node, checked; it opens no connection yet."""

    def __init__(
        self, connect: str | None, *, ros1: bool = False, ros2: bool = False, node: str = NODE, robot: str | None = None
    ) -> None:
        given = {"--connect": connect is not None, "--ros1": ros1, "--ros2": ros2}
        if sum(given.values()) > 1:
            options.refuse(f"{' and '.join(name for name in given if given[name])}: give one of them")
        self.node = node_name(node)
        self._address = options.address("--connect", connect) if connect else (LOOPBACK, DEFAULT_PORT)
        self._limits = None if robot is None else JointLimits.of(load_robot(robot, output.warn).robot)
        self._ros1 = installation.find() if ros1 else None
        self._ros2 = _find_ros2() if ros2 else None

    def session(self, suffix: str = "") -> NodeClient:
        """Return a new connection, with a suffix to its name: names are unique in ROS."""
        name = self.node + suffix
        in_ros: dict[str, Any] = {"node": name, "timeout": _NODE_TIMEOUT, "sign": JOINT_STATES}
        if self._ros1 is not None:
            return NodeClient(Ros1Transport(self._ros1.python, environment=self._ros1.environment, **in_ros))
        if self._ros2 is not None:
            found = self._ros2
            return NodeClient(
                Ros2Transport(found.python, environment=found.environment, arguments=ros_arguments, **in_ros)
            )
        host, port = self._address
        try:
            return NodeClient(SocketTransport((host, port), node=name))
        except UsageError as error:
            more = f" --port {port}" if (host, port) != (LOOPBACK, DEFAULT_PORT) else ""
            raise UsageError(f"{error}; start one with: cellwright teleop ROBOT{more}") from None

    @contextmanager
    def robot(self) -> Iterator[OperatedRobot]:
        """Return the robot; its connection is closed at the end."""
        session = self.session()
        try:
            try:
                robot = OperatedRobot(session)
            except RunEndedError as error:
                raise UsageError(f"the node has ended: {error}") from None
            yield robot
        finally:
            session.close()

    @staticmethod
    def name(robot: OperatedRobot) -> str:
        """Return the robot's name as its node reports it; ROS has no place for that."""
        welcome = getattr(robot.session.transport, "welcome", {})
        return str(welcome.get("trial") or "robot")

    def limits(self, robot: OperatedRobot) -> JointLimits:
        """Return the known limits of the robot's joints."""
        if self._limits is not None:
            missing = [name for name in self._limits.joints if name not in robot.joints]
            if missing:
                raise UsageError(
                    f"--robot: {self._limits.source} has a joint {missing[0]} that the node's robot lacks; "
                    "give the description of that robot"
                )
            return self._limits
        called = self.name(robot).lower()
        if self._ros1 is not None:
            limits = described_limits(self._ros1.environment)
        elif self._ros2 is not None:
            limits = published_limits(robot.session)
        elif called in bundled():
            limits = JointLimits.of(load_robot(called, lambda _line: None).robot)
        else:
            return JointLimits()
        return limits if set(limits.joints) <= set(robot.joints) else JointLimits()


def warn_of_unknown(limits: JointLimits) -> None:
    """Warn that nothing was checked against limits, if none are known."""
    if not limits.joints:
        output.warn("joint limits unknown: targets are not checked against them; give the description with --robot")


def figures_table(exercises: Sequence[Exercise]) -> FittedTable:
    """Return a table of the figures of all joints, a line each."""
    has_steps = any(each.tracking.step for each in exercises)
    headings = ["RMS", "max", "delay", *(["rise", "settling", "overshoot", "rest"] if has_steps else [])]
    rows = []
    for each in exercises:
        figures = each.tracking
        row = [each.trace.joint, f"{figures.rms:.4f}", f"{figures.worst:.4f}", _milliseconds(figures.delay)]
        rows.append([*row, *(_step(figures.step) if has_steps else [])])
    columns = {"joint": FOLD, **dict.fromkeys(headings, RIGHT)}
    return table(columns, rows, box=None, header_style="bold", show_edge=True, pad_edge=True)


def show_plot(console: Console, exercise: Exercise) -> None:
    """Draw a joint's targets and its motion in the characters of the terminal."""
    trace = exercise.trace
    curves = [
        Curve("target", trace.target_times, trace.targets, "yellow"),
        Curve("measured", trace.measured_times, trace.measured, "cyan"),
    ]
    width = min(console.width, _PLOT_WIDTH)
    console.print(terminal_plot(curves, width=width, height=_PLOT_HEIGHT, unit="rad; m"))


def figures_document(exercise: Exercise) -> dict[str, Any]:
    """Return the figures of one joint as JSON values: rad or m, s, Hz."""
    wave, figures, step = exercise.wave, exercise.tracking, exercise.tracking.step
    return {
        "joint": exercise.trace.joint,
        "wave": wave.shape.value,
        "amplitude": wave.amplitude,
        "frequency": wave.frequency,
        "duration": wave.duration,
        "start": exercise.start,
        "rms_error": figures.rms,
        "max_error": figures.worst,
        "judged_error": figures.judged,
        "delay": figures.delay,
        "state_rate": figures.rate,
        "step": None
        if step is None
        else {"overshoot": step.overshoot, "rise": step.rise, "settling": step.settling, "rest": step.rest},
        "note": exercise.note,
    }


def csv_text(exercises: Sequence[Exercise]) -> str:
    """Return every measured position with its target: joint, time [s], target, measured, error [rad; m]."""
    lines = ["joint,time,target,measured,error\n"]
    for each in exercises:
        trace = each.trace
        rows = np.column_stack(
            [trace.measured_times, trace.target_in_force, trace.measured, trace.target_in_force - trace.measured]
        )
        for time, target, seen, error in rows.tolist():
            lines.append(f"{trace.joint},{time:.6f},{target:.9g},{seen:.9g},{error:.9g}\n")
    return "".join(lines)


def _step(step: JointStepResponse | None) -> list[str]:
    if step is None:
        return ["", "", "", ""]
    overshoot = f"{100 * step.overshoot:.1f} %"
    return [_milliseconds(step.rise), _milliseconds(step.settling), overshoot, f"{step.rest:.4f}"]


def _milliseconds(time: float | None) -> str:
    return "never" if time is None else f"{time * 1e3:.0f} ms"


def signal(
    joints: Annotated[
        list[str],
        argument(
            "JOINT",
            "Joints, moved one after another in this order; `J_arm_r_*` means all that match except mimic joints, the "
            "robot's last one first.",
        ),
    ],
    wave: Annotated[
        WaveShape,
        option(
            "SHAPE",
            "`sine` swings to both sides of the joint's position; `step` and `ramp` move away from it and back.",
            WHAT,
        ),
    ] = WaveShape.SINE,
    amplitude: Annotated[float, option("A", "Amplitude [rad; m]; below 0, downwards first.", WHAT)] = 0.1,
    frequency: Annotated[float, option("F", "Frequency [Hz].", WHAT)] = 0.5,
    duration: Annotated[float, option("T", "Duration for each joint [s]; rounded to whole periods.", WHAT)] = 4.0,
    connect: Connect = None,
    ros1: OverRos1 = False,
    ros2: OverRos2 = False,
    robot: Robot = None,
    node: Node = NODE,
    max_error: Annotated[
        float | None,
        option(
            "E", "Exit with status 1 if the maximum error is larger [rad; m]; for a step, the error at its end.", RESULT
        ),
    ] = None,
    max_delay: Annotated[
        float | None,
        option("MS", "Exit with status 1 if a joint's delay is larger [ms], or it does not follow.", RESULT),
    ] = None,
    as_json: AsJson = False,
    csv: Annotated[Path | None, option("FILE.csv", "Write every measured position to this file.", RESULT)] = None,
    plot: Annotated[Path | None, option("FILE.svg", "Plot targets, positions and errors to this file.", RESULT)] = None,
) -> None:
    """Send a test signal to joints, and measure how well they follow it.

    Each joint gets a target on /io_teleop/joint_cmd 100 times a second, around its present position, and returns there
    at the end. Begin with a small amplitude, and with the joints farthest from the body. A joint that follows well
    shows no vibration, no overshoot, and little delay.

        # a tenth of a radian to both sides, twice
        cellwright operate signal J_arm_r_07

        # steps, for all joints of an arm
        cellwright operate signal 'J_arm_r_*' --wave step --amplitude 0.2

        # in CI: fails if a joint is more than 0.05 rad off
        cellwright operate signal J_head_yaw --max-error 0.05 --json

    Error is target minus measured position. Delay is the time shift at which the position matches the target best. Rise
    is from 10 to 90 % of a step. Settling ends when the joint stays within 5 % of the step. Of several steps the worst
    counts.

    Exit status: 0 done; 1 an error or a delay was larger than allowed, or the node has ended; 2 bad input, and nothing
    was moved.
    """
    full_wave = Wave.lasting(wave, amplitude, frequency, duration)
    options.in_range("--max-error", max_error, 0.0, math.inf, "a number of at least 0")
    options.in_range("--max-delay", max_delay, 0.0, math.inf, "a number of at least 0")
    options.output_file("--csv", csv, ".csv")
    options.output_file("--plot", plot, ".svg")
    link = NodeConnection(connect, ros1=ros1, ros2=ros2, node=node, robot=robot)
    console = Console(stderr=as_json, highlight=False)
    with link.robot() as operated:
        limits = link.limits(operated)
        chosen = _chosen(operated, joints, limits)
        for warning in check_signal(operated, chosen, full_wave, limits):
            warn(warning)
        warn_of_unknown(limits)
        exercises, failure = _exercise(operated, chosen, full_wave, console)
    failures = _failures(exercises, max_error, max_delay) + ([failure] if failure else [])
    if csv is not None:
        failures += write_result(csv, csv_text(exercises))
    if plot is not None and exercises:
        failures += write_result(plot, tracking_svg(exercises))
    status = NOT_DONE if failures else DONE
    if as_json:
        document: dict[str, Any] = {"joints": [figures_document(each) for each in exercises]}
        typer.echo(json.dumps(document | {"failures": failures, "exit_status": status}, indent=2))
    else:
        _show(console, exercises)
    for line in failures:
        echo(line, err=True)
    raise typer.Exit(status)


def _chosen(robot: OperatedRobot, patterns: Sequence[str], limits: JointLimits) -> list[str]:
    """Return the joints that match the patterns, each once; a wildcard matches no mimic joint beside other joints."""
    chosen: list[str] = []
    for pattern in patterns:
        if not any(sign in pattern for sign in "*?["):
            if pattern in playback.GRIPPERS and pattern not in robot.joints:
                raise UsageError(
                    f"{pattern} is a gripper, not a joint; move it with cellwright operate play, from a file with "
                    f"the columns {', '.join(playback.GRIPPERS)}"
                )
            robot.check_names([pattern])
            chosen.append(pattern)
            continue
        matching = fnmatch.filter(reversed(robot.joints), pattern)
        if not matching:
            raise UnknownNameError("joint", pattern, robot.joints)
        chosen += [name for name in matching if name not in limits.leaders] or matching
    return list(dict.fromkeys(chosen))


def _exercise(robot: OperatedRobot, joints: Sequence[str], wave: Wave, console: Console) -> tuple[list[Exercise], str]:
    """Return the exercise of each joint, and the error if there was one; joints after that do not move."""
    exercises: list[Exercise] = []
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.fields[at]}"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("", total=1.0, at="")

        def show(part: float) -> None:
            progress.update(task, completed=part)

        for number, joint in enumerate(joints, start=1):
            progress.reset(task, description=joint, at=f"{number} of {len(joints)}")
            try:
                exercises.append(exercise(robot, joint, wave, on_progress=show))
            except (CellwrightError, RunEndedError) as error:
                return exercises, f"{joint}: {error}"
    return exercises, ""


def _failures(exercises: Sequence[Exercise], max_error: float | None, max_delay: float | None) -> list[str]:
    lines = []
    for each in exercises:
        figures, joint = each.tracking, each.trace.joint
        if max_error is not None and figures.judged > max_error:
            lines.append(f"{joint}: error {figures.judged:.4g} exceeds --max-error {max_error:g}")
        if max_delay is not None and figures.delay is None:
            lines.append(f"{joint}: does not follow its target")
        elif max_delay is not None and figures.delay is not None and figures.delay * 1e3 > max_delay:
            lines.append(f"{joint}: delay {figures.delay * 1e3:.0f} ms exceeds --max-delay {max_delay:g}")
    return lines


def _show(console: Console, exercises: Sequence[Exercise]) -> None:
    for each in exercises:
        print_line(console, f"{each.trace.joint}: {each.wave.shape} from {round(each.start, 4):g}")
        show_plot(console, each)
        console.print()
    if exercises:
        print_table(console, figures_table(exercises))
    for each in exercises:
        if each.note:
            print_line(console, f"{each.trace.joint}: {each.note}", "yellow")


class NodeCommand(StrEnum):
    """Command of `cellwright operate call` to a robot's node."""

    HOME = "home"
    ENABLE = "enable"
    DISABLE = "disable"
    STOP = "stop"
    CLEAR_STOP = "clear-stop"


def call(
    command: Annotated[
        NodeCommand, argument("COMMAND", "`home`, `enable`, `disable`, `stop` (the emergency stop), or `clear-stop`.")
    ],
    connect: Connect = None,
    ros1: OverRos1 = False,
    ros2: OverRos2 = False,
    node: Node = NODE,
) -> None:
    """Send one command to a robot's node: go home, enable or disable commands, stop, or clear the stop.

    It returns when the node has answered; for `home`, when the robot has arrived.

        cellwright operate call home

    Exit status: 0 done; 1 the node refused, or did not answer; 2 bad input.
    """
    link = NodeConnection(connect, ros1=ros1, ros2=ros2, node=node)
    with link.robot() as robot:
        try:
            if command is NodeCommand.STOP:
                robot.send(Now.STOP)
                robot.session.wait_until(
                    lambda: robot.status is not None and robot.status.emergency_stop, _STOP_TIMEOUT
                )
                done = robot.status is None or bool(robot.status.emergency_stop)
                text = "stopped" if done else "sent, but the node has not reported the stop"
            else:
                response = robot.session.call(*service_request(Ask[command.name]))
                done, text = bool(response.success), str(response.message)
        except (CellwrightError, RunEndedError) as error:
            done, text = False, str(error)
    echo(f"{command}: {text}" if text else command.value, err=not done)
    raise typer.Exit(DONE if done else NOT_DONE)


def keyboard(
    connect: Connect = None, ros1: OverRos1 = False, ros2: OverRos2 = False, robot: Robot = None, node: Node = NODE
) -> None:
    """Drive a robot with the keys of this terminal: joints, tips, grippers, home, enable, emergency stop.

    Each key press is one step from the robot's present position; on release nothing is sent, and the robot holds. The
    screen lists the keys. Joints move by /io_teleop/joint_cmd, tips by /io_teleop/target_ee_poses, and grippers by
    /io_teleop/target_gripper_status. The space bar sends /io_teleop/emergency_stop, also while the robot goes home;
    this is a software stop and replaces no hardware circuit.

        cellwright operate keyboard

        # your own robot, with its limits on the screen
        cellwright operate keyboard --robot my_robot/vr_configs.yml

    Exit status: 0 quit with q or Ctrl-C; 1 the node has ended, or a signal ended the process; 2 bad input, or no
    terminal.
    """
    if not sys.stdin.isatty() or not sys.stdout.isatty():
        options.refuse(
            "the keyboard operator requires a terminal; without one use cellwright operate play FILE "
            "or cellwright operate signal JOINT"
        )
    link = NodeConnection(connect, ros1=ros1, ros2=ros2, node=node, robot=robot)
    console = Console(highlight=False)
    ended = ""
    with link.robot() as operated, closing(ServiceCaller(lambda: link.session("_services"))) as services:
        limits = link.limits(operated)
        operator = Keyboard(operated, Jog(operated, limits), services)
        name = link.name(operated)
        live = Live(console=console, screen=True, auto_refresh=False)

        def draw() -> None:
            shown = panel(
                operated, operator.jog, limits, name=name, message=operator.message, height=console.size.height
            )
            live.update(shown, refresh=True)

        try:
            with terminal_keyboard() as read, live:
                operator.run(read, draw)
        except KeyboardInterrupt:
            pass
        except (RunEndedError, TerminatedError) as error:
            ended = str(error)
    if ended:
        echo(f"error: {ended}", err=True)
    print_line(console, f"{operated.sent} messages sent; the robot holds its last targets")
    raise typer.Exit(NOT_DONE if ended else DONE)


def record(
    file: Annotated[Path, argument("FILE", "File to write, .csv or .jsonl.")],
    duration: Annotated[
        float | None, option("T", "Duration [s], from the first message on. Default: until Ctrl-C.", WHAT)
    ] = None,
    targets: Annotated[
        bool, flag("--targets", "Write the targets that the node applies, instead of measured positions.", WHAT)
    ] = False,
    connect: Connect = None,
    ros1: OverRos1 = False,
    ros2: OverRos2 = False,
    node: Node = NODE,
) -> None:
    """Record a robot's joint positions, 100 times a second, for `cellwright operate play`.

    Each line goes to disk at once, so that a failure loses nothing.

        cellwright operate record motion.csv --duration 10

    Exit status: 0 recorded; 1 the node has ended or sent nothing, or the disk is full; 2 bad input.
    """
    suffix = file.suffix.lower() if file.suffix.lower() == ".jsonl" else ".csv"
    path = options.output_file("FILE", file, suffix)
    options.in_range("--duration", duration, options.ABOVE_0, options.LATEST, "a time above 0 s")
    link, console = NodeConnection(connect, ros1=ros1, ros2=ros2, node=node), Console(highlight=False)
    failures: list[str] = []
    with link.robot() as robot:
        session, stop = robot.session, StopCondition()
        recorder = JointRecorder(robot, path, topic=APPLIED if targets else JOINT_STATES, report=failures.append)
        length = float("inf") if duration is None else duration
        end = session.time + length + _MAX_SILENCE
        with stopped_by_signals(stop.request):
            try:
                while not stop.is_requested and recorder.is_writing and recorder.time < length and session.time < end:
                    session.sleep(min(_CHECK_PERIOD, max(_MIN_SLEEP, length - recorder.time)))
                recorder.close()
            except RunEndedError as error:
                failures.append(str(error))
    if not recorder.lines and not failures:
        failures.append(f"no messages on {APPLIED if targets else JOINT_STATES}")
    for failure in failures:
        echo(f"error: {failure}", err=True)
    print_line(console, f"{recorder.lines} samples, {recorder.time:.1f} s, in {file}")
    raise typer.Exit(NOT_DONE if failures else DONE)


class _StopRequestedError(Exception):
    """The user has requested the end."""


def play(
    file: Annotated[
        Path, argument("FILE", "File of targets: CSV, JSON lines, a ROS 1 bag, or the folder of a ROS 2 bag.")
    ],
    speed: Annotated[float, option("FACTOR", "Seconds of the file per second.", WHAT)] = 1.0,
    approach: Annotated[
        float | None,
        option(
            "T", "Duration of the approach to the first targets [s]. Default: as long as it takes at 0.5 rad/s.", WHAT
        ),
    ] = None,
    loop: Annotated[bool, flag("--loop", "Restart at the end, until Ctrl-C.", WHAT)] = False,
    topic: Annotated[
        str | None,
        option("TOPIC", "For a bag: take this topic's joint states as targets. Default: all its commands.", WHAT),
    ] = None,
    connect: Connect = None,
    ros1: OverRos1 = False,
    ros2: OverRos2 = False,
    robot: Robot = None,
    node: Node = NODE,
    as_json: AsJson = False,
) -> None:
    """Play a file of targets: move slowly to the first of them, then send each at its time.

    A CSV file begins with the line `time,JOINT,JOINT`; times are in seconds, positions in rad or m. An empty field
    leaves its joint out. A line of JSON is `{"time": 0.0, "positions": {"JOINT": 0.1}}`. In both, `gripper_right` and
    `gripper_left` are the closing of a gripper, 0 to 1. From a bag, the io_teleop commands are played, each on its own
    topic.

        cellwright operate record motion.csv --duration 10
        cellwright operate play motion.csv --speed 0.5

        # a recording of another program: measured positions become targets
        cellwright operate play session.bag --topic /io_teleop/joint_states

    Exit status: 0 played, or stopped by Ctrl-C; 1 the robot did not reach the first targets, refused a command, or its
    node has ended; 2 bad input, and nothing was moved.
    """
    options.in_range("--speed", speed, options.ABOVE_0, options.FINITE, "a factor above 0")
    options.in_range("--approach", approach, 0.0, options.LATEST, "a time of at least 0 s")
    targets = _read_any_targets(file, topic)
    link = NodeConnection(connect, ros1=ros1, ros2=ros2, node=node, robot=robot)
    console = Console(stderr=as_json, highlight=False)
    failure, rounds = "", 0
    with link.robot() as operated:
        limits = link.limits(operated)
        playback.check(operated, targets, limits)
        warn_of_unknown(limits)
        stop = StopCondition()
        with stopped_by_signals(stop.request):
            try:
                while loop or rounds == 0:
                    _play_once(operated, targets, speed, approach, console, stop)
                    rounds += 1
            except (CellwrightError, RunEndedError) as error:
                failure = str(error)
            except _StopRequestedError:
                pass
    status = NOT_DONE if failure else DONE
    outcome = "failed" if failure else "stopped" if stop.is_requested else "done"
    if failure:
        echo(f"error: {failure}", err=True)
    if as_json:
        document = {
            "file": str(file),
            "moments": len(targets.samples),
            "duration": targets.duration,
            "outcome": outcome,
            "rounds": rounds,
            "messages": operated.sent,
            "error": failure,
            "exit_status": status,
        }
        typer.echo(json.dumps(document, indent=2))
    elif not failure:
        times = f"{rounds} times, " if loop else ""
        print_line(console, f"{outcome}: {times}{operated.sent} messages sent")
    raise typer.Exit(status)


def _read_any_targets(file: Path, topic: str | None) -> Targets:
    from cellwright.clients.operators.bags import is_bag, read_bag  # slow to load

    if is_bag(file):
        return read_bag(file, topic)
    if topic is not None:
        options.refuse("--topic requires a bag")
    return read_targets(file)


def _play_once(
    robot: OperatedRobot, targets: Targets, speed: float, approach: float | None, console: Console, stop: StopCondition
) -> None:
    """Play the targets once."""
    columns = (TextColumn("{task.description}"), BarColumn(), TextColumn("{task.completed:.1f} s"))
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("approaching the first targets", total=None)

        def beat(time: float) -> None:
            if stop.is_requested:
                raise _StopRequestedError
            progress.update(task, completed=time)

        playback.approach(robot, targets.first, approach, on_progress=beat)
        progress.update(task, description=str(targets.path), total=targets.duration)
        playback.play(robot, targets, speed=speed, on_progress=beat)


app = typer.Typer(
    name="operate",
    help="""Drive a robot's controller node without a headset.

    An operator is a client like any other: it connects over the node's socket, over ROS 1 or over ROS 2, and uses the
    io_teleop topics. Start the node first, in another terminal:

        cellwright teleop qinglong             # the robot
        cellwright operate keyboard            # move it with keys
        cellwright operate signal J_head_yaw   # measure how well a joint follows
        cellwright operate record motion.csv   # record the robot's motion
        cellwright operate play motion.csv     # play it
        cellwright operate call home           # one command, for scripts""",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
)
app.command()(keyboard)
app.command()(signal)
app.command()(record)
app.command()(play)
app.command()(call)
