"""Command `cellwright teleop`: a robot controller node, or one of the checks."""

import time
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any

import typer
from rich.console import Console

from cellwright.cli import options, output
from cellwright.cli.arguments import record_options
from cellwright.cli.main import DONE
from cellwright.cli.parameters import with_groups
from cellwright.cli.run.policy import policy_of
from cellwright.cli.teleop.arguments import TeleopArguments
from cellwright.cli.teleop.checks import run_driver_check, run_motion_check
from cellwright.cli.teleop.node import robot_progress, robot_session, run_robot
from cellwright.config.robot.robots import load_robot
from cellwright.middleware.ros1.identity import node_name
from cellwright.rendering.views import gear2017_views
from cellwright.robot.drivers import find_driver
from cellwright.robot.node import RobotNode, RobotSettings
from cellwright.robot.ros2_control import ros2_control_xacro
from cellwright.running.run.robot_policy import RobotPolicy
from cellwright.running.run.robots import RobotTarget


@with_groups
def teleop(given: TeleopArguments) -> None:
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

        # a policy server drives it for ten seconds of simulation time
        cellwright teleop qinglong --policy ws://127.0.0.1:8000 --policy-map map.yaml --latency 120ms --until 10

        # a real robot, by your own driver
        cellwright teleop my_robot/vr_configs.yml --driver my_driver.py:MyDriver

    Always: names that the robot lacks are ignored, invalid messages are refused as a whole, targets are kept within the
    joints' limits, and the emergency stop holds at once.

    Exit status: 0 stopped as requested; 1 the simulation became unstable, the policy could not be asked, a requested
    file is incomplete, or a check failed; 2 bad input, and nothing was started.
    """
    load = partial(load_robot, given.robot, arguments=options.xacro_arguments(given.xacro_arguments))
    if given.ros2_control:
        typer.echo(ros2_control_xacro(load(output.warn)), nl=False)
        raise typer.Exit(DONE)
    given.refuse()
    if given.driver is not None and given.check_driver:
        raise typer.Exit(run_driver_check(given.driver, load))
    console = Console(stderr=given.as_json, highlight=False)
    timestep = 1 / options.physics_rate(given.rate)
    settings = RobotSettings(given.motion, timestep, given.self_collision)
    safety, window = given.safety.settings(), given.window()
    serve = given.network.options(lockstep=given.lockstep)
    about: dict[str, Any] = {"agent": given.policy.policy} if given.has_policy else {}
    more: dict[str, Any] = {
        "until": options.until(given.until),
        "serve": replace(serve, restart_refusal="a policy drives the robot") if given.has_policy else serve,
        "view": given.page.options() or False,
        "record": record_options(given.record, given.video.options(gear2017_views()), **about),
    }
    if given.check:
        raise typer.Exit(run_motion_check(RobotNode(load(output.warn), settings), console, as_json=given.as_json))
    make_driver = None if given.driver is None else find_driver(given.driver)
    progress = robot_progress(console, until=given.until)
    with ExitStack() as leaving:
        policy = policy_of(given.policy, leaving)

        def make() -> RobotNode:
            config = load(output.warn)
            if policy is not None:
                policy.check_robot(config, timestep)
            return RobotNode(
                config,
                replace(settings, safety=safety, node=node_name(given.node), sim_time=given.has_sim_time),
                stamp=time.time_ns,
                report=progress.notice,
                driver=None if make_driver is None else make_driver(config),
            )

        session = robot_session(
            RobotTarget(make, node=given.node, sim_time=given.has_sim_time),
            console,
            progress,
            speed=given.factor(),
            window=window,
            **more,
        )
        program = None if policy is None else RobotPolicy(policy.robot_agent(given.seed or 0))
        status = run_robot(
            session, console, program=program, window=window, as_json=given.as_json, verbose=given.verbose
        )
    raise typer.Exit(status)
