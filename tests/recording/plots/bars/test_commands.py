"""States as bars, commands as strips."""

from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure

from cellwright.recording.plots.bars import MAX_COMMANDS, command_rows, draw_commands
from cellwright.recording.plots.tracks import CommandTrack
from tests.recording.plots.plot_data import robot


def test_rows_have_state_names_and_command_counts() -> None:
    axes = Figure().add_subplot()
    draw_commands(axes, robot())
    assert [text.get_text() for text in axes.get_yticklabels()] == ["safety", "joint_cmd", "set_enabled"]
    drawn = [text.get_text().strip() for text in axes.texts]
    assert drawn == ["takes commands", "emergency stop", "takes commands", "1000", "1"]


def test_many_commands_show_most_used_only() -> None:
    tracks = [CommandTrack(f"/a/b{n}", np.linspace(0, 20, n + 1)) for n in range(20)]
    data = replace(robot(), commands=tracks, states={})
    assert command_rows(data) == MAX_COMMANDS
    axes = Figure().add_subplot()
    draw_commands(axes, data)
    assert [text.get_text() for text in axes.get_yticklabels()] == [f"b{n}" for n in range(20 - MAX_COMMANDS, 20)]


def test_long_command_name_is_complete() -> None:
    axes = Figure().add_subplot()
    name = "/ariac/arm/follow_joint_trajectory/goal"
    draw_commands(axes, replace(robot(), commands=[CommandTrack(name, np.array([1.0]))], states={}))
    (label,) = [text.get_text() for text in axes.get_yticklabels()]
    assert label == "arm/follow_joint_trajectory/goal"
