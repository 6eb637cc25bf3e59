"""Tests of what a target must have, and of what only some can do."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.cell.cell import Cell
from cellwright.engine.clock import nanoseconds
from cellwright.running.run import ServerOptions, Session
from cellwright.running.run.cells import CellTarget
from cellwright.running.run.playback import PlaybackTarget
from cellwright.running.run.robots import RobotTarget
from cellwright.running.run.target import (
    Ending,
    Filmable,
    HasPanel,
    Player,
    Prepared,
    Recordable,
    Refereed,
    Restartable,
    RosNamed,
    RunControls,
    Target,
)
from cellwright.util.errors import RejectedCommandError, UsageError
from tests.clients.operators import nodes as robots
from tests.support.cells import BARE

ABILITIES = (Prepared, Ending, Player, Restartable, Refereed, HasPanel, RosNamed, Recordable, Filmable)


class Least(Target):
    """Has what a target must have, and nothing else."""

    acts, stopped = "watch", "it has stopped"

    def open(self, controls: RunControls) -> None:
        self.node = Cell(BARE)

    def close(self) -> None:
        pass


def abilities_of(target: Target) -> set[type]:
    return {each for each in ABILITIES if isinstance(target, each)}


def test_each_kind_of_target_has_its_abilities() -> None:
    shown = {Restartable, HasPanel, RosNamed}
    assert abilities_of(Least()) == set()
    assert abilities_of(PlaybackTarget(Path("a.mcap"))) == {*shown, Prepared, Player}
    robot = RobotTarget.of(robots.robot(), is_real_time=False)
    assert abilities_of(robot) == {*shown, Ending, Recordable, Filmable}
    assert abilities_of(CellTarget(lambda: Cell(BARE))) == {*shown, Prepared, Ending, Refereed, Recordable, Filmable}


def test_session_does_without_abilities_that_its_target_lacks(tmp_path: Path) -> None:
    with Session(Least(), serve=ServerOptions(port=0)) as session:
        result = session.run(until=0.1)
        assert (result.outcome, session.node.simulation.now) == ("until", nanoseconds(0.1))
        with pytest.raises(RejectedCommandError, match="cannot start again"):
            session.reset()
    for file, words in (("a.mcap", "record: "), ("a.mp4", "video: "), ("a.jsonl", "log: ")):
        with pytest.raises(UsageError, match=words):
            Session(Least(), record=tmp_path / file).run(until=0.1)
    with pytest.raises(UsageError, match="no node of ROS"):
        Session(Least(), serve=ServerOptions(ros1=True)).run(until=0.1)
    assert not list(tmp_path.iterdir())
