"""Tests of `cellwright operate signal` at a served node."""

import csv
import json
import threading
import xml.etree.ElementTree as ET
from contextlib import ExitStack
from pathlib import Path

import pytest

from cellwright.cli.operate.connection import AddressArguments, NodeConnection
from cellwright.cli.operate.signal import _chosen
from cellwright.clients.operators.robot import JointLimits
from cellwright.robot.node import RobotNode
from tests.cli.conftest import CommandLine
from tests.cli.operate.conftest import UNCHECKED
from tests.clients.operators.nodes import robot, served
from tests.support.waiting import wait_until

QUICK = ("--frequency", "1", "--duration", "1")


@pytest.mark.slow
def test_signal_plots_and_prints_figures_of_each_joint(cellwright: CommandLine, address: str) -> None:
    enough = ("--max-error", "0.01", "--max-delay", "100")  # for a step, the error at its end
    ran = cellwright("operate", "signal", "right_[56]", *QUICK, "--wave", "step", "--connect", address, *enough)
    assert (ran.status, ran.err) == (0, UNCHECKED)
    assert [line for line in ran.out.splitlines() if ": step from" in line] == [
        "right_6: step from 0",  # of the joints that match a pattern, the last of the robot comes first
        "right_5: step from 0.4",
    ]
    assert ran.out.count("━ target  ━ measured") == 2
    heads, *rows = [line.split() for line in ran.out.splitlines() if line.strip()][-3:]
    assert heads == ["joint", "RMS", "max", "delay", "rise", "settling", "overshoot", "rest"]
    assert [row[0] for row in rows] == ["right_6", "right_5"]
    assert all(abs(float(row[2]) - 0.1) < 0.002 and 20 <= float(row[3]) <= 70 for row in rows)


def test_signal_writes_json_and_files_and_exits_by_limits(
    cellwright: CommandLine, address: str, tmp_path: Path
) -> None:
    files = ("--csv", "samples.csv", "--plot", "plot.svg")
    limits = ("--max-error", "0.01", "--max-delay", "10")
    ran = cellwright("operate", "signal", "right_4", *QUICK, "--connect", address, "--json", *files, *limits)
    document = json.loads(ran.out)
    (joint,) = document["joints"]
    assert (joint["joint"], joint["wave"], joint["duration"]) == ("right_4", "sine", 1.0)
    assert ran.status == document["exit_status"] == 1
    assert ran.err.splitlines() == [UNCHECKED.strip(), *document["failures"]]
    assert [line.partition(" exceeds ")[2] for line in document["failures"]] == ["--max-error 0.01", "--max-delay 10"]
    rows = list(csv.DictReader((tmp_path / "samples.csv").read_text().splitlines()))
    errors = [float(row["error"]) for row in rows]
    assert len(rows) == pytest.approx(150, abs=3)
    assert max(map(abs, errors)) == pytest.approx(joint["max_error"])
    assert all(float(row["target"]) - float(row["measured"]) == pytest.approx(float(row["error"])) for row in rows)
    assert ET.parse(tmp_path / "plot.svg").getroot().tag.endswith("svg")


def test_joint_that_does_not_follow_exceeds_max_delay(cellwright: CommandLine, address: str) -> None:
    # a finger cannot go below its lower limit, which the operator does not know
    few = ("right_finger", "--amplitude", "-0.04", "--wave", "ramp", *QUICK)
    ran = cellwright("operate", "signal", *few, "--connect", address, "--max-delay", "1000")
    assert (ran.status, ran.err) == (1, UNCHECKED + "right_finger: does not follow its target\n")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["rigth_1"], "unknown joint 'rigth_1'; did you mean right_1"),
        (
            ["gripper_right"],
            "gripper_right is a gripper, not a joint; move it with cellwright operate play, from a file",
        ),
        (["nothing_*"], "unknown joint 'nothing_*'"),
        (["right_1", "--amplitude", "0"], "amplitude"),
        (["right_1", "--frequency", "-1"], "frequency"),
        (["right_1", "--duration", "nan"], "duration"),
        (["right_1", "--wave", "square"], "square"),
        (["right_1", "--max-error", "-1"], "--max-error -1"),
        (["right_1", "--max-delay", "nan"], "--max-delay nan"),
        (["right_1", "--plot", "plot.png"], "--plot plot.png: give a file whose name ends in .svg"),
        (["right_1", "--csv", "no/such.csv"], "there is no folder no"),
        (["right_1", "--connect", "nowhere"], "--connect nowhere: give a host and a port"),
        (["right_1", "--ros1"], "--connect and --ros1: give one of them"),
        (["right_1", "--ros1", "--ros2"], "--connect and --ros1 and --ros2: give one of them"),
        (["right_1", "--node", "no name"], "is not a node name"),
        (["right_1", "--robot", "qinglon"], "unknown robot 'qinglon'; did you mean qinglong"),
        (["right_1", "--robot", "qinglong"], "--robot: "),
        ([], "Missing argument"),
    ],
)
def test_invalid_input_prints_one_line_and_moves_nothing(
    arguments: list[str], message: str, cellwright: CommandLine, address: str
) -> None:
    where = [] if "--connect" in arguments else ["--connect", address]
    ran = cellwright("operate", "signal", *arguments, *where)
    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith("error: ")
    assert message in ran.err
    assert ran.err.count("\n") == 1


def test_wildcard_skips_mimic_joints_unless_it_matches_no_other(address: str) -> None:
    limits = JointLimits(leaders={"right_6": "right_5"})
    with NodeConnection(AddressArguments(address)).robot() as operated:
        assert _chosen(operated, ["right_[56]"], limits) == ["right_5"]
        assert _chosen(operated, ["right_6*"], limits) == ["right_6"]


def test_error_without_node_names_command_to_start_one(cellwright: CommandLine) -> None:
    ran = cellwright("operate", "signal", "right_1", "--connect", "127.0.0.1:1")
    assert ran.status == 2
    assert "start one with: cellwright teleop ROBOT --port 1" in ran.err


def test_node_that_ends_during_signal_is_reported(cellwright: CommandLine) -> None:
    with ExitStack() as stack:
        node = RobotNode(robot())
        host, port = stack.enter_context(served(node))

        def end_it() -> None:
            wait_until(lambda: node.commander.taken > 5, "signal under way", seen=lambda: node.commander.taken)
            stack.close()

        end = threading.Thread(target=end_it)
        end.start()
        ran = cellwright("operate", "signal", "right_6", "right_5", "--duration", "30", "--connect", f"{host}:{port}")
        end.join()
    assert ran.status == 1
    assert ran.err == UNCHECKED + "right_6: the test is over\n"
