"""`cellwright teleop`: a robot's controller node."""

from __future__ import annotations

from functools import partial

import typer

from cellwright.cli import options, recorded, videos
from cellwright.cli.arguments import Host, Port, Record, Until
from cellwright.cli.teleop.arguments import (
    AsJson,
    Check,
    CheckDriver,
    Clutch,
    GuardThen,
    Gui,
    InitDebug,
    InRos1,
    Lockstep,
    MaxAge,
    MaxSpeed,
    MotionLaw,
    NodeName,
    OneCommander,
    OwnDriver,
    Rate,
    ResumeSpeed,
    Robot,
    SelfCollision,
    SimTime,
    Snapshot,
    Speed,
    StartDisabled,
    StartGuard,
    TipSpeed,
    TipTurning,
    Verbose,
    Watchdog,
)
from cellwright.cli.teleop.driver import run_check
from cellwright.cli.teleop.motion_check import run_motion_check
from cellwright.cli.teleop.node import run_node
from cellwright.cli.teleop.options import TeleopOptions
from cellwright.cli.teleop.sight import Sight
from cellwright.cli.view.arguments import Open, View, ViewHost, ViewPort, page_wish
from cellwright.config.robot.robots import load_robot
from cellwright.middleware.server.server import LOOPBACK
from cellwright.robot.drivers.own import find_driver
from cellwright.robot.interface.rows import NODE
from cellwright.robot.safety.settings import RESUME_SPEED, Guard, SafetySettings
from cellwright.robot.servos import Motion


def teleop(
    robot: Robot,
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
    one_commander: OneCommander = None,
    max_age: MaxAge = None,
    tip_speed: TipSpeed = None,
    tip_turning: TipTurning = None,
    clutch: Clutch = False,
    driver: OwnDriver = None,
    check_driver: CheckDriver = False,
    until: Until = None,
    host: Host = LOOPBACK,
    port: Port = None,
    gui: Gui = False,
    init_debug: InitDebug = False,
    snapshot: Snapshot = None,
    ros1: InRos1 = False,
    node: NodeName = NODE,
    view: View = False,
    view_host: ViewHost = None,
    view_port: ViewPort = None,
    open_page: Open = False,
    record: Record = None,
    video: videos.File = None,
    video_camera: videos.From = None,
    video_speed: videos.Speed = 1.0,
    video_size: videos.Size = videos.USUAL_SIZE,
    video_fine: videos.Fine = False,
    as_json: AsJson = False,
    verbose: Verbose = False,
) -> None:
    """Run a robot's controller node: it moves as the `io_teleop` topics say, until Ctrl-C.

    Programs connect over a socket; what happens is a line each.

        # the QingLong humanoid, in real time
        cellwright teleop qinglong

        # the same, on a page that shows and drives it
        cellwright teleop qinglong --view

        # a robot of your own
        cellwright teleop my_robot/vr_configs.yml

        # for programs of ROS 1, with a master if there is none
        cellwright teleop qinglong --ros1

        # with care: a silent operator, and a first jump, are no accident
        cellwright teleop qinglong --watchdog 0.5 --start-guard 0.8

        # does it move as the robot does? a table of what was looked at
        cellwright teleop qinglong --check

        # a real robot, by a driver of your own
        cellwright teleop my_robot/vr_configs.yml --driver my_driver.py:MyDriver

    Always: names that the robot lacks are passed over, messages that make no sense are refused whole, targets are kept
    within the joints' limits, and the emergency stop holds at once.

    Exit status: 0 stopped, by whatever was asked for; 1 the simulation became unstable, a file that was asked for
    is not whole, or a check found something; 2 bad input, and nothing was started.
    """
    factor = options.speed(("max" if lockstep else "1") if speed is None else speed)
    if factor != 1.0 and not (sim_time or lockstep):
        options.refuse(f"--speed {speed}: time other than the wall clock's has to be told: add --sim-time")
    if driver is not None and (sim_time or lockstep):
        options.refuse("--driver: a real robot keeps real time: leave out --sim-time and --lockstep")
    if driver is not None and not check_driver:
        _refuse_what_is_simulated(motion, self_collision=self_collision)
    if guard is not Guard.REFUSE and start_guard is None:
        options.refuse(f"--start-guard-then {guard}: say how far away a first target has to be: add --start-guard 0.8")
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
    )
    if check_driver:
        if check:
            options.refuse("--check and --check-driver: give one of them")
        if safety != SafetySettings():
            options.refuse("--check-driver: leave out the options of safety: the driver is told its targets directly")
        raise typer.Exit(run_check(driver, partial(load_robot, robot)))
    wanted = TeleopOptions(
        motion=motion,
        timestep=1 / options.physics_rate(rate),
        self_collision=self_collision,
        safety=safety,
        sim_time=sim_time or lockstep,
        speed=factor,
        lockstep=lockstep,
        until=options.until(until),
        host=host,
        port=port,
        driver=None if driver is None else find_driver(driver),
        sight=Sight(gui or init_debug, init_debug, options.output_file("--snapshot", snapshot, ".png")),
        ros1=ros1,
        node=node,
        as_json=as_json,
        verbose=verbose,
        record=recorded.wanted(record),
        video=videos.wish(video, video_camera, video_speed, video_size, fine=video_fine),
        page=page_wish(view=view, host=view_host, port=view_port, opens=open_page),
    )
    run = run_motion_check if check else run_node
    raise typer.Exit(run(partial(load_robot, robot), wanted))


def _refuse_what_is_simulated(motion: Motion, *, self_collision: bool) -> None:
    """Refuse what says how a robot is simulated, where none is."""
    given = [("--motion teleport", motion is not Motion.SERVO), ("--self-collision", self_collision)]
    if said := [option for option, is_given in given if is_given]:
        options.refuse(f"--driver: a robot of your own moves as it does: leave out {' and '.join(said)}")
