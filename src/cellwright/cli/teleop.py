"""`cellwright teleop`: a robot's controller node."""

from __future__ import annotations

from functools import partial

import typer

from cellwright.cli import options
from cellwright.cli.arguments import Until
from cellwright.cli.teleop_arguments import (
    AsJson,
    Clutch,
    GuardThen,
    Host,
    Lockstep,
    MaxAge,
    MaxSpeed,
    MotionLaw,
    OneCommander,
    Port,
    Rate,
    ResumeSpeed,
    Robot,
    SelfCollision,
    SimTime,
    Speed,
    StartDisabled,
    StartGuard,
    TipSpeed,
    TipTurning,
    Verbose,
    Watchdog,
)
from cellwright.cli.teleop_node import TeleopOptions, run_node
from cellwright.description.robot.robots import load_robot
from cellwright.devices.joint_servos import Motion
from cellwright.server import DEFAULT_PORT
from cellwright.server.server import LOOPBACK
from cellwright.teleop.safety import RESUME_SPEED, Guard, SafetySettings


def teleop(
    robot: Robot,
    motion: MotionLaw = Motion.SERVO,
    rate: Rate = "240",
    self_collision: SelfCollision = False,
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
    until: Until = None,
    host: Host = LOOPBACK,
    port: Port = DEFAULT_PORT,
    as_json: AsJson = False,
    verbose: Verbose = False,
) -> None:
    """Run a robot's controller node: it moves as the `io_teleop` topics say, until Ctrl-C.

    Programs connect over a socket; what happens is a line each.

        # the QingLong humanoid, in real time
        cellwright teleop qinglong

        # a robot of your own
        cellwright teleop my_robot/vr_configs.yml

        # with care: a silent operator, and a first jump, are no accident
        cellwright teleop qinglong --watchdog 0.5 --start-guard 0.8

    Always: names that the robot lacks are passed over, messages that make no sense are refused whole, targets are kept
    within the joints' limits, and the emergency stop holds at once.

    Exit status: 0 stopped, by whatever was asked for; 1 the simulation became unstable; 2 bad input, and nothing was
    started.
    """
    factor = options.speed(("max" if lockstep else "1") if speed is None else speed)
    if factor != 1.0 and not (sim_time or lockstep):
        options.refuse(f"--speed {speed}: time other than the wall clock's has to be told: add --sim-time")
    wanted = TeleopOptions(
        motion=motion,
        timestep=1 / options.physics_rate(rate),
        self_collision=self_collision,
        safety=SafetySettings(
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
        ),
        sim_time=sim_time or lockstep,
        speed=factor,
        lockstep=lockstep,
        until=options.until(until),
        host=host,
        port=port,
        as_json=as_json,
        verbose=verbose,
    )
    raise typer.Exit(run_node(partial(load_robot, robot), wanted))
