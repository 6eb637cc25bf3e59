"""Tests of the options of `cellwright eval`."""

import pytest

from cellwright.cli.eval.arguments import ARM_AND_SENSORS, LimitArguments, evaluated_trials
from cellwright.util.errors import UsageError


def test_limits_are_seconds_and_bytes() -> None:
    limits = LimitArguments(time_limit=10.0, start_limit=20.0, memory_limit=512.0).limits()
    assert (limits.wall, limits.start, limits.memory) == (10.0, 20.0, 512 * 2**20)


@pytest.mark.parametrize(
    ("limits", "message"),
    [
        (LimitArguments(time_limit=0.0), "--time-limit 0: give a number from 0.1"),
        (LimitArguments(start_limit=0.5), "--start-limit 0.5: give a number from 1"),
        (LimitArguments(memory_limit=1.0), "--memory-limit 1: give a number from 256"),
    ],
)
def test_limits_that_no_run_can_keep_are_refused(limits: LimitArguments, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        limits.limits()


def test_trial_without_arm_is_joined_with_the_bundled_one() -> None:
    lesson, final = evaluated_trials(["lesson", "final01"], [])
    assert lesson.given == ("lesson",)
    assert final.given == ("final01", ARM_AND_SENSORS)
