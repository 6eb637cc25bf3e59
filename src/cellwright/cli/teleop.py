"""Command `cellwright teleop`: a robot controller node, or checks of a robot's motion and of a driver."""

import json
import math
import time
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.text import Text

from cellwright.cli import arguments, options, output
from cellwright.cli.arguments import LOCKSTEP_HELP, NETWORK, OUTPUT, ROBOT_HELP, SIMULATION, SPEED_HELP
from cellwright.cli.main import DONE, NOT_DONE, argument, flag, option
from cellwright.cli.output import echo, progress_bar
from cellwright.cli.signals import stopped_by_signals
from cellwright.cli.summary import RunProgress
from cellwright.cli.tables import FOLD, RIGHT, WHOLE, FittedTable, print_table, table
from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.robots import load_robot
from cellwright.engine.rate_control import RateControl
from cellwright.middleware.ros1.host.ros1 import node_name
from cellwright.robot.checks.driver import check_driver
from cellwright.robot.checks.motion import check_motion
from cellwright.robot.checks.reference import MAX_RANGE_ERROR, MAX_TIME_ERROR
from cellwright.robot.checks.rig import Finding, MotionReport
from cellwright.robot.drivers import find_driver
from cellwright.robot.interface import NODE
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.ros2_control import ros2_control_xacro
from cellwright.robot.safety import RESUME_SPEED, Guard, SafetySettings
from cellwright.robot.servos import Motion
from cellwright.running.run import ServerOptions, Session, SessionResult, versions
from cellwright.running.run.robots import RobotTarget, RobotWindow
from cellwright.util.errors import UsageError
from cellwright.viewer.web.start import LOOPBACK

_PERCENT = (
    f"%: of a step's height, a sine's swing, a gripper's travel\n"
    f"   tolerance of steps and sines: {100 * MAX_RANGE_ERROR:g} %, or {1e3 * MAX_TIME_ERROR:.0f} ms early or late"
)
_SAFETY_OPTIONS = "the safety options"
SAFETY = "Safety"
"""Heading for options in the help."""


def run_driver_check(driver: str | None, load: Callable[[Callable[[str], None]], RobotConfig]) -> int:
    """Check a driver, and print each finding in a line; return the exit status."""
    if driver is None:
        options.refuse("--check-driver requires --driver (for example --driver my_driver.py:MyDriver)")
    make = find_driver(driver)
    problems = check_driver(make, load(partial(typer.echo, err=True)))
    for problem in problems:
        echo(f"{driver}: {problem}")
    if not problems:
        typer.echo("ok")
    return NOT_DONE if problems else DONE


def refuse_node_options(given: Mapping[str, bool]) -> None:
    """Refuse options that are given, and that need a node that keeps running."""
    for name, is_given in given.items():
        if is_given:
            hint = "; measure a limited node with cellwright operate signal JOINT" if name == _SAFETY_OPTIONS else ""
            options.refuse(f"--check cannot be combined with {name}{hint}")


def show_motion_report(console: Console, report: MotionReport) -> None:
    """Print a row for each finding, and a summary."""
    recorded = f"compared with its recorded motion, {Path(report.reference).name}"
    against = recorded if report.reference else "joint by joint, since it has no recorded motion"
    output.print_line(console, f"{report.robot} in its node, {against}")
    console.print()
    print_table(console, findings_table(report))
    if report.reference:
        console.print(_PERCENT, markup=False)
    for finding in report.findings:
        if finding.note and finding.passed:
            output.print_line(console, f"  {finding.what}: {finding.note}")
        if finding.remedy:
            output.print_line(console, f"  {finding.what}: {finding.remedy}")
    good = sum(finding.passed for finding in report.findings)
    console.print()
    console.print(f"passed      {good} of {len(report.findings)}", markup=False)


def findings_table(report: MotionReport) -> FittedTable:
    """Return a table with a row for each finding."""
    rows = []
    for finding in report.findings:
        verdict = Text("ok", style="green") if finding.passed else Text("FAILS", style="bold red")
        limit = f"{finding.limit:.3g} {finding.unit}"
        rows.append((Text(finding.what), _figure(finding), limit, Text(finding.where), verdict))
    return table({"check": FOLD, "worst": RIGHT, "limit": RIGHT, "where": FOLD, "": WHOLE}, rows)


def motion_document(report: MotionReport) -> dict[str, Any]:
    """Return the report as JSON values; a figure that does not exist is null."""
    findings = [asdict(finding) for finding in report.findings]
    for finding in findings:
        if not math.isfinite(finding["worst"]):
            finding["worst"] = None
    return {"robot": report.robot, "reference": report.reference or None, "passed": report.passed, "findings": findings}


def _figure(finding: Finding) -> str:
    if not math.isfinite(finding.worst):
        return "-"
    return f"{finding.worst:.0f}" if finding.unit == "differ" else f"{finding.worst:.2f}"


def robot_progress(console: Console, *, until: float | None) -> RunProgress:
    """Return the progress output of a robot controller node; `until` is the time at which it stops [s], if any."""

    def status(session: Session) -> str:
        node, loop = session.node, session.loop
        pace = "" if loop.rate.speed is None else f"  {loop.pacer.factor:.2f} x real time"
        commands = f"  {node.commander.taken} commands taken, {node.refused} refused, {node.commander.ignored} ignored"
        return f"{node.simulation.time:.1f} s{pace}{commands}"

    return RunProgress(console, until=until, status=status)


def show_node_result(console: Console, node: RobotNode, result: SessionResult, *, verbose: bool) -> None:
    """Print the summary for people."""
    console.print()
    note = partial(output.print_entry, console)
    note("commands", f"{node.commander.taken} taken, {node.refused} refused, {node.commander.ignored} ignored")
    for source, count in sorted(node.bus.refusals.counts.items()):
        note(f"refused {count}", source)
    note("ran" if node.has_driver else "simulated", f"{node.simulation.time:.1f} s in {result.wall:.1f} s")
    if result.pace is not None:
        note("pace", output.pace_text(result.pace))
    if verbose:
        note("state hash", node.simulation.state_hash())
        note("versions", ", ".join(f"{name} {version}" for name, version in versions().items()))


def node_document(node: RobotNode, result: SessionResult, status: int) -> dict[str, Any]:
    """Return the summary as JSON values; times in s."""
    return {
        "robot": node.name,
        "motion": node.settings.motion.value,
        "timestep": float(node.simulation.clock.timestep),
        "outcome": result.outcome,
        "exit_status": status,
        "error": result.error,
        "simulated": node.simulation.time,
        "wall": result.wall,
        "steps": node.simulation.clock.tick,
        "state_hash": node.simulation.state_hash(),
        "commands": {"taken": node.commander.taken, "refused": node.refused, "ignored": node.commander.ignored},
        "refused": dict(node.bus.refusals.counts),
        "unknown_names": list(node.commander.notices.unknown),
        "pace": None if result.pace is None else asdict(result.pace),
        "recordings": [str(path) for path in result.recordings],
        "videos": result.videos,
        "versions": versions(),
    }


def robot_session(
    target: RobotTarget,
    console: Console,
    progress: RunProgress,
    *,
    speed: float | None,
    window: RobotWindow | None = None,
    **more: Any,
) -> Session:
    """Return a session of a robot controller node that prints its events on a console; `more` are its arguments."""
    return Session(
        target,
        rate=RateControl(speed),
        observers=[progress] if window is None else [window, progress],
        on_ready=output.report_ready,
        **output.session_outputs(console, progress.notice),
        **more,
    )


def run_robot(
    session: Session,
    console: Console,
    *,
    window: RobotWindow | None = None,
    as_json: bool = False,
    verbose: bool = False,
) -> int:
    """Run a robot controller node until a signal or its time ends it, and print the result; return the exit status."""
    with stopped_by_signals(session.stop.request), session:
        result = session.run()
    node, snapshot = session.node, None if window is None else window.snapshot
    if not as_json:
        show_node_result(console, node, result, verbose=verbose)
    if window is not None and snapshot is not None:
        try:
            with progress_bar(console, f"drawing {snapshot}", 1.0) as show:
                window.save(node, show)  # after the summary, since it takes a while
        except UsageError as error:
            result.error = result.error or str(error)
        else:
            if not as_json:
                output.print_entry(console, "picture", str(snapshot))
    if not as_json:
        output.print_files(console, "video", map(arguments.video_sentence, result.videos))
        output.print_files(console, "recording", result.recordings)
    status = NOT_DONE if result.error or not result.is_complete else DONE
    if result.error:
        echo(f"error: {result.error}", err=True)
    if as_json:
        typer.echo(json.dumps(node_document(node, result, status), indent=2))
    return status


Robot = Annotated[str, argument("ROBOT", ROBOT_HELP)]
MotionLaw = Annotated[
    Motion, option("LAW", "`servo`: within the URDF's speeds and efforts; `teleport`: at once.", SIMULATION)
]
Rate = Annotated[str, option("HZ", "Physics steps per second.", SIMULATION)]
Check = Annotated[
    bool,
    flag(
        "--check", "Check the robot's motion, against its recorded motion or else joint by joint, and stop.", SIMULATION
    ),
]
SelfCollision = Annotated[bool, flag("--self-collision", "Let the robot's links collide with each other.", SIMULATION)]
SimTime = Annotated[
    bool, flag("--sim-time", "Publish simulation time on /clock, and stamp messages with it.", SIMULATION)
]
Speed = Annotated[str | None, option("FACTOR", f"{SPEED_HELP} Values other than `1` require --sim-time.", SIMULATION)]
Lockstep = Annotated[bool, flag("--lockstep", f"{LOCKSTEP_HELP}; implies --sim-time.", SIMULATION)]
Verbose = Annotated[bool, flag("--verbose -v", "Print more in the summary.", OUTPUT)]

OwnDriver = Annotated[
    str | None,
    option(
        "FILE.py:CLASS", "Move your own robot by your own driver; nothing is simulated.", SIMULATION, name="--driver"
    ),
]
CheckDriver = Annotated[
    bool,
    flag(
        "--check-driver",
        "Move each joint of that robot by 0.02 and back, print the errors of its driver, and stop.",
        SIMULATION,
    ),
]
Ros2Control = Annotated[
    bool,
    flag(
        "--ros2-control",
        "Print a xacro file with which ros2_control, and so MoveIt, drives this robot over its topics, and stop.",
        arguments.NETWORK,
    ),
]
Gui = Annotated[bool, flag("--gui", "Show the robot in MuJoCo's window.", OUTPUT)]
InitDebug = Annotated[
    bool, flag("--init-debug", "Show it in MuJoCo's window with a slider for each joint, under `Control`.", OUTPUT)
]
Snapshot = Annotated[Path | None, option("FILE.png", "Write a picture of the robot at the end.", OUTPUT)]

StartDisabled = Annotated[
    bool, flag("--start-disabled", "Take no commands until the service /io_teleop/set_enabled enables them.", SAFETY)
]
Watchdog = Annotated[
    float | None, option("S", "Hold the joints that a topic moves after this silence on it [s], such as 0.5.", SAFETY)
]
MaxSpeed = Annotated[
    list[str] | None,
    option(
        "[JOINTS=]V",
        "Limit the speed of targets [rad/s; m/s]; `J_arm_*=1.5` for the joints that match. Repeatable; the last "
        "match counts.",
        SAFETY,
    ),
]
StartGuard = Annotated[
    float | None,
    option("D", "Maximum distance of a first target from the joint's position [rad; m], such as 0.8.", SAFETY),
]
GuardThen = Annotated[
    Guard,
    option(
        "ACTION",
        "Action for a first target farther away: `refuse`, or `blend` (go there slowly).",
        SAFETY,
        name="--start-guard-then",
    ),
]
ResumeSpeed = Annotated[
    float, option("V", "Speed of the first approach after a stop, a silence or a blend [rad/s; m/s].", SAFETY)
]
OneCommander = Annotated[
    float | None, option("S", "Take a topic from one node only, until that node has been silent this long [s].", SAFETY)
]
CommandTopic = Annotated[
    list[str] | None,
    option(
        "TOPIC",
        "Topic that commands the robot, such as `joint_cmd`; others are ignored. Repeatable. Default: all.",
        SAFETY,
    ),
]
MaxAge = Annotated[
    float | None,
    option("S", "Refuse commands older than this by their stamp [s], or stamped earlier than the one before.", SAFETY),
]
Clutch = Annotated[
    bool, flag("--clutch", "Apply targets relative to the first target and the joint positions at that time.", SAFETY)
]
TipSpeed = Annotated[float | None, option("V", "Speed of arm tips towards target poses [m/s]. Default: 2.", SAFETY)]
TipTurning = Annotated[
    float | None,
    option("W", "Angular speed of arm tips towards target poses [rad/s]. Default: one turn per second.", SAFETY),
]
NodeName = Annotated[str, option("NAME", "Name of the node in ROS.", NETWORK, name="--node")]


def teleop(
    robot: Robot,
    xacro_arguments: arguments.XacroArguments = None,
    motion: MotionLaw = Motion.SERVO,
    rate: Rate = "240",
    self_collision: SelfCollision = False,
    check: Check = False,
    sim_time: SimTime = False,
    speed: Speed = None,
    lockstep: Lockstep = False,
    start_disabled: StartDisabled = False,
    watchdog: Watchdog = None,
    max_speed: MaxSpeed = None,
    start_guard: StartGuard = None,
    guard: GuardThen = Guard.REFUSE,
    resume_speed: ResumeSpeed = RESUME_SPEED,
    command_topic: CommandTopic = None,
    one_commander: OneCommander = None,
    max_age: MaxAge = None,
    tip_speed: TipSpeed = None,
    tip_turning: TipTurning = None,
    clutch: Clutch = False,
    driver: OwnDriver = None,
    check_driver: CheckDriver = False,
    until: arguments.Until = None,
    host: arguments.Host = LOOPBACK,
    port: arguments.Port = None,
    gui: Gui = False,
    init_debug: InitDebug = False,
    snapshot: Snapshot = None,
    ros1: arguments.Ros1 = False,
    ros2: arguments.Ros2 = False,
    ros2_range: arguments.Ros2Range = None,
    ros2_names: arguments.Ros2Names = None,
    ros2_control: Ros2Control = False,
    node: NodeName = NODE,
    view: arguments.View = False,
    view_host: arguments.ViewHost = None,
    view_port: arguments.ViewPort = None,
    open_page: arguments.OpenPage = False,
    record: arguments.Record = None,
    video: arguments.VideoFile = None,
    video_camera: arguments.VideoCamera = None,
    video_speed: arguments.VideoSpeed = 1.0,
    video_size: arguments.VideoSize = arguments.DEFAULT_VIDEO_SIZE,
    video_fine: arguments.VideoFine = False,
    as_json: arguments.AsJson = False,
    verbose: Verbose = False,
) -> None:
    """Run a robot's controller node, which follows the `io_teleop` topics, until Ctrl-C.

    Programs connect over a socket. Each event is a line of output.

        # the QingLong humanoid, in real time
        cellwright teleop qinglong

        # the same, on a page that shows and drives it
        cellwright teleop qinglong --view

        # your own robot
        cellwright teleop my_robot/vr_configs.yml

        # for ROS 1 programs; starts a master if there is none
        cellwright teleop qinglong --ros1

        # safer: hold when the operator is silent, refuse a jump at the start
        cellwright teleop qinglong --watchdog 0.5 --start-guard 0.8

        # for ROS 2 programs, and for MoveIt over ros2_control
        cellwright teleop qinglong --ros2
        cellwright teleop qinglong --ros2-control > qinglong.ros2_control.xacro

        # check its motion, and print a table of findings
        cellwright teleop qinglong --check

        # a real robot, by your own driver
        cellwright teleop my_robot/vr_configs.yml --driver my_driver.py:MyDriver

    Always: names that the robot lacks are ignored, invalid messages are refused as a whole, targets are kept within the
    joints' limits, and the emergency stop holds at once.

    Exit status: 0 stopped as requested; 1 the simulation became unstable, a requested file is incomplete, or a check
    failed; 2 bad input, and nothing was started.
    """
    load = partial(load_robot, robot, arguments=options.xacro_arguments(xacro_arguments))
    if ros2_control:
        typer.echo(ros2_control_xacro(load(output.warn)), nl=False)
        raise typer.Exit(DONE)
    factor = options.speed(("max" if lockstep else "1") if speed is None else speed)
    if factor != 1.0 and not (sim_time or lockstep):
        options.refuse(f"--speed {speed} requires --sim-time")
    if driver is not None and (sim_time or lockstep):
        options.refuse("--driver: a real robot runs in real time; leave out --sim-time and --lockstep")
    if driver is not None and not check_driver:
        given = {"--motion teleport": motion is not Motion.SERVO, "--self-collision": self_collision}
        if simulated := [option for option, is_given in given.items() if is_given]:
            options.refuse(f"--driver simulates nothing; leave out {' and '.join(simulated)}")
    if guard is not Guard.REFUSE and start_guard is None:
        options.refuse(f"--start-guard-then {guard} requires --start-guard (for example --start-guard 0.8)")
    safety = SafetySettings(
        start_disabled=start_disabled,
        silence=watchdog,
        max_speeds=tuple(map(options.joint_speed, max_speed or ())),
        start_guard=start_guard,
        guard=guard,
        resume_speed=resume_speed,
        one_commander=one_commander,
        max_age=max_age,
        tip_speed=tip_speed,
        tip_turning=tip_turning,
        clutch=clutch,
        command_topics=tuple(map(options.command_topic, command_topic or ())),
    )
    if check_driver:
        if check:
            options.refuse("--check and --check-driver: give one of them")
        if safety != SafetySettings():
            options.refuse("--check-driver sends targets to the driver directly; leave out the safety options")
        raise typer.Exit(run_driver_check(driver, load))
    timestep, console = 1 / options.physics_rate(rate), Console(stderr=as_json, highlight=False)
    make_driver = None if driver is None else find_driver(driver)
    page = arguments.page_options(view=view, host=view_host, port=view_port, opens=open_page)
    window = RobotWindow(gui or init_debug, init_debug, options.output_file("--snapshot", snapshot, ".png"))
    until = options.until(until)
    kept = arguments.record_options(record)
    filmed = arguments.video_options(video, video_camera, video_speed, video_size, fine=video_fine)
    if check:
        refuse_node_options(
            {
                "--until": until is not None,
                "--lockstep": lockstep,
                "--sim-time": sim_time,
                "--speed": factor != 1.0,
                "--driver": driver is not None,
                "--ros1": ros1,
                "--ros2": ros2,
                "--record": kept is not None,
                "--video": filmed is not None,
                "--view": page is not None,
                "--gui, --init-debug and --snapshot": window != RobotWindow(is_shown=False),
                _SAFETY_OPTIONS: safety != SafetySettings(),
            }
        )
        config = load(output.warn)
        with closing(RobotNode(config, RobotSettings(motion, timestep, self_collision))) as checked:
            report = check_motion(checked)
        if as_json:
            typer.echo(json.dumps(motion_document(report), indent=2))
        else:
            show_motion_report(console, report)
        raise typer.Exit(DONE if report.passed else NOT_DONE)
    progress = robot_progress(console, until=until)

    def make() -> RobotNode:
        config = load(output.warn)
        return RobotNode(
            config,
            RobotSettings(motion, timestep, self_collision, safety, node_name(node), sim_time or lockstep),
            stamp=time.time_ns,
            report=progress.notice,
            driver=None if make_driver is None else make_driver(config),
        )

    session = robot_session(
        RobotTarget(make, node=node, sim_time=sim_time or lockstep),
        console,
        progress,
        speed=factor,
        window=window,
        until=until,
        lockstep=lockstep,
        serve=ServerOptions(host, port),
        view=page or False,
        ros1=ros1,
        ros2=arguments.ros2_options(ros2=ros2, discovery=ros2_range, names=ros2_names),
        record=kept,
        video=filmed,
    )
    raise typer.Exit(run_robot(session, console, window=window, as_json=as_json, verbose=verbose))
