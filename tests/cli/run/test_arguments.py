"""Tests of the options of `cellwright run`."""

import pytest

from cellwright.cli.run.arguments import ProcessArguments, ViewingArguments
from cellwright.clients.agents.lesson import LessonAgent
from cellwright.util.errors import UsageError


@pytest.mark.parametrize(
    ("process", "message"),
    [
        (ProcessArguments(lockstep=True), "--lockstep requires --over"),
        (ProcessArguments("pigeon"), "--over pigeon: give socket, ros1 or ros2"),
    ],
)
def test_processes_that_there_are_not_are_refused(process: ProcessArguments, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        process.refuse()


def test_program_is_a_new_agent_for_each_run() -> None:
    program = ProcessArguments().program("lesson", has_end=False, is_verbose=False)
    first, second = program(), program()
    assert isinstance(first, LessonAgent)
    assert first is not second


def test_run_without_agent_requires_an_end() -> None:
    with pytest.raises(UsageError, match="--agent none requires --until"):
        ProcessArguments().program("none", has_end=False, is_verbose=False)
    assert ProcessArguments().program("none", has_end=True, is_verbose=False)() is None


def test_picture_of_no_camera_is_refused() -> None:
    with pytest.raises(UsageError, match="--camera 1,2:3"):
        ViewingArguments(camera="1,2:3").pictures()
