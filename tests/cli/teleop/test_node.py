"""Tests of the session of a robot's node on the command line."""

import io

from rich.console import Console

from cellwright.cli.teleop.node import node_document, robot_progress, robot_session
from cellwright.robot.node import RobotNode
from cellwright.running.run import ServerOptions
from cellwright.running.run.robots import RobotTarget
from tests.clients.operators.nodes import robot


def test_session_of_a_node_counts_its_commands_and_ends_at_its_time() -> None:
    console = Console(file=io.StringIO(), width=100)
    progress = robot_progress(console, until=0.1)
    target = RobotTarget(lambda: RobotNode(robot()))
    session = robot_session(target, console, progress, speed=None, until=0.1, serve=ServerOptions(port=0))
    with session:
        result = session.run()
        document = node_document(session.node, result, 0)
    assert (document["simulated"], document["steps"], document["motion"]) == (0.1, 24, "servo")
    assert document["commands"] == {"taken": 0, "refused": 0, "ignored": 0}
    assert isinstance(console.file, io.StringIO)
    assert "ready: " in console.file.getvalue()
