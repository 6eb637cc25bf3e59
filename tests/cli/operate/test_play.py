"""Tests of `cellwright operate play` and `record` at a served node."""

import json
import signal
import threading
from pathlib import Path

import pytest

from cellwright.robot.node import RobotNode
from tests.cli.conftest import CommandLine
from tests.cli.operate.conftest import UNCHECKED
from tests.clients.operators.nodes import robot, served
from tests.support.waiting import wait_until

MOTION = "time,right_1,left_2\n0,0.1,0.6\n0.1,0.15,\n0.2,0.2,0.5\n"


@pytest.fixture
def motion(tmp_path: Path) -> str:
    (tmp_path / "motion.csv").write_text(MOTION)
    return "motion.csv"


def test_file_is_played_and_motion_recorded(motion: str, cellwright: CommandLine, address: str, tmp_path: Path) -> None:
    quick = ("--approach", "0.2", "--speed", "2", "--connect", address)
    ran = cellwright("operate", "play", motion, "--json", *quick)
    document = json.loads(ran.out)
    assert (ran.status, ran.err, document["outcome"], document["rounds"]) == (0, UNCHECKED, "done", 1)
    assert (document["moments"], document["duration"]) == (3, 0.2)
    assert document["messages"] >= 3 + 15
    ran = cellwright("operate", "record", "did.jsonl", "--duration", "0.1", "--connect", address)
    assert (ran.status, ran.err) == (0, "")
    assert " samples, 0.1 s, in did.jsonl" in ran.out
    last = json.loads((tmp_path / "did.jsonl").read_text().splitlines()[-1])["positions"]
    assert last["right_1"] == pytest.approx(0.2, abs=0.01)
    assert last["left_2"] == pytest.approx(0.5, abs=0.01)
    ran = cellwright("operate", "record", "targets.csv", "--targets", "--duration", "0.05", "--connect", address)
    assert ran.status == 0
    assert (tmp_path / "targets.csv").read_text().startswith("time,right_1,right_2,")
    ran = cellwright("operate", "play", "targets.csv", "--approach", "0.1", "--connect", address)
    assert ran.out.startswith("done: ")
    assert ran.out.endswith(" messages sent\n")


def test_loop_ends_on_signal(motion: str, cellwright: CommandLine) -> None:
    node = RobotNode(robot())
    before = signal.signal(signal.SIGINT, signal.default_int_handler)  # the shell may ignore it

    def interrupt() -> None:
        wait_until(lambda: node.commander.taken > 60, "third round", seen=lambda: node.commander.taken)
        signal.raise_signal(signal.SIGINT)

    with served(node, lockstep=True) as (host, port):
        stop = threading.Thread(target=interrupt)
        stop.start()
        ran = cellwright("operate", "play", motion, "--loop", "--approach", "0.05", "--connect", f"{host}:{port}")
        stop.join()
    signal.signal(signal.SIGINT, before)
    assert (ran.status, ran.err) == (0, UNCHECKED)
    assert ran.out.startswith("stopped: ")


def test_play_stops_if_robot_does_not_reach_first_targets(
    cellwright: CommandLine, address: str, tmp_path: Path
) -> None:
    (tmp_path / "far.csv").write_text("time,right_1\n0,9\n1,0\n")
    ran = cellwright("operate", "play", "far.csv", "--approach", "0", "--connect", address)
    assert (ran.status, ran.out) == (1, "")
    assert ran.err.startswith(
        UNCHECKED + "error: right_1 did not reach the first target: it is at 2, and the target is 9"
    )


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["play", "none.csv"], "none.csv: cannot be read: No such file or directory"),
        (["play", "bad.csv"], "bad.csv:2: right_1: must be a number (got 'x')"),
        (["play", "strange.csv"], "unknown joint 'rigth_1'; did you mean right_1"),
        (["play", "motion.csv", "--speed", "0"], "--speed 0: give a factor above 0"),
        (["play", "motion.csv", "--approach", "-1"], "--approach -1: give a time"),
        (["play", "motion.csv", "--topic", "/arm"], "--topic requires a bag"),
        (["play", "."], "cannot be read as a bag"),
        (["record", "motion.txt"], "give a file whose name ends in .csv"),
        (["record", "no/motion.csv"], "there is no folder no"),
        (["record", "did.csv", "--duration", "0"], "--duration 0: give a time above 0 s"),
    ],
)
def test_invalid_input_prints_one_line_and_moves_nothing(
    arguments: list[str], message: str, motion: str, cellwright: CommandLine, address: str, tmp_path: Path
) -> None:
    (tmp_path / "bad.csv").write_text("time,right_1\n0,x\n")
    (tmp_path / "strange.csv").write_text("time,rigth_1\n0,0\n")
    ran = cellwright("operate", *arguments, "--connect", address)
    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith("error: ")
    assert message in ran.err
    assert ran.err.count("\n") == 1
