"""Tools of arms as a file states them."""

import pytest

from cellwright.config.gripper import Pad, ParallelGripperSettings
from cellwright.config.layout.arms import Tool
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.errors import DescriptionError
from tests.cell.arm_cells import ARMS, FINGERS


def tool_of(text: str) -> Tool:
    (arm,) = load_trial(text=FINGERS.format(model=ARMS / "ur5.urdf", tool=text, mass=0.5)).trial.arms
    return arm.tool


@pytest.mark.parametrize(
    ("text", "tool"),
    [
        ("{kind: vacuum}", Tool()),
        ("{kind: vacuum, length: 0.2}", Tool(length=0.2)),
        ("{kind: none}", Tool("none")),
        ("{kind: parallel}", Tool("parallel", 0.06 + 0.02 + 0.038 / 2, ParallelGripperSettings())),
        (
            "{kind: parallel, opening: 0.08, force: 60, holds: friction, length: 0.15, pad: {friction: 0.8}}",
            Tool("parallel", 0.15, ParallelGripperSettings(0.08, 60.0, pad=Pad(friction=0.8), holds="friction")),
        ),
    ],
)
def test_tool_is_read(text: str, tool: Tool) -> None:
    assert tool_of(text) == tool


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("{kind: vacuum, opening: 0.1}", r":9: .*opening: a tool of kind vacuum has none; .* kind: parallel"),
        ("{kind: none, length: 0.1}", r":9: .*length: a tool of kind none has none; .* kind: vacuum or parallel"),
        ("{kind: parallel, length: 0.05}", r":9: .*length: must be at least 0.099 m.*\(got 0.05\)"),
        ("{kind: parallel, opening: 2}", r":9: .*opening: must be from 0.005 to 0.5 m \(got 2\)"),
        ("{kind: parallel, pad: {friction: 9}}", r":9: .*friction: must be from 0.05 to 3 \(got 9\)"),
        ("{kind: parallel, holds: glue}", r":9: .*unknown way to hold a part 'glue'"),
    ],
)
def test_mistake_is_refused_with_its_line(text: str, error: str) -> None:
    with pytest.raises(DescriptionError, match=error):
        tool_of(text)
