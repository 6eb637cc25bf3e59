"""Figures: requested panels, written atomically, in three formats."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from cellwright.recording.plots.figure import FIGURE_SUFFIXES, PANELS, draw_figure, write_figure
from cellwright.recording.plots.tracks import CommandTrack, JointTrack, Mark, PlotData, Span
from cellwright.util.errors import UsageError
from tests.recording.plots.plot_data import cell, robot


def titles(figure: Figure) -> list[str]:
    return [axes.get_title(loc="left") for axes in figure.axes]


def words(figure: Figure) -> str:
    texts = [text.get_text() for axes in figure.axes for text in axes.texts]
    return "\n".join([*(text.get_text() for text in figure.texts), *texts])


def test_figure_of_cell_has_all_panels_in_order() -> None:
    figure = draw_figure(cell())
    assert titles(figure) == [
        "Score",
        "On the trays",
        "arm",
        "arm: rail",
        "Tool height",
        "States and commands",
        "Tool from above",
    ]
    drawn = words(figure)
    for word in ("lesson", "kitter, seed 0: 8 of 12 points", "order_0_kit_0: 8 of 12", "piston rod 9", "wrist 3"):
        assert word in drawn


def test_figure_of_robot_has_all_panels() -> None:
    figure = draw_figure(robot())
    assert titles(figure) == ["right arm", "Heights of the tools", "States and commands", "Tools from above"]
    assert "emergency stop" in words(figure)


@pytest.mark.parametrize("name", PANELS)
def test_single_panel_has_time_axis(name: str) -> None:
    figure = draw_figure(cell(), [name])
    assert figure.axes
    over_time = [axes for axes in figure.axes if axes.get_title(loc="left") != "Tool from above"]
    assert {axes.get_xlim() for axes in over_time} == {(0.0, 60.0)}
    assert over_time[-1].get_xlabel() == "simulation time [s]"


@pytest.mark.slow
@pytest.mark.parametrize("suffix", FIGURE_SUFFIXES)
def test_hostile_title_is_drawn_without_control_characters(
    suffix: str, tmp_path: Path, recwarn: pytest.WarningsRecorder
) -> None:
    hostile = "$\\frac{ \x1b[2J 漢 \x00"
    write_figure(draw_figure(replace(cell(), title=hostile, note=hostile), ["score"]), tmp_path / f"a{suffix}")
    content = (tmp_path / f"a{suffix}").read_bytes()
    assert content
    assert suffix != ".svg" or b"\x1b" not in content
    assert not recwarn.list


def test_axes_have_units() -> None:
    labels = {axes.get_ylabel() for axes in draw_figure(cell()).axes}
    assert {"points", "position [rad]", "position [m]", "z [m]", "x [m]"} <= labels


def test_panels_without_data_are_left_out_or_refused() -> None:
    empty = PlotData("lesson", "", 0.0, 0.0)
    with pytest.raises(UsageError, match="lesson: has nothing to plot in score, tool"):
        draw_figure(empty, ["score", "tool"])
    assert titles(draw_figure(replace(cell(), tools=(), commands=(), states={}, tray_parts=()))) == [
        "Score",
        "arm",
        "arm: rail",
    ]


def test_recording_of_one_moment_is_drawn() -> None:
    once = np.zeros(1)
    moment = PlotData("r", "", 0.0, 0.0, joints={"arm": [JointTrack("a", "rad", once, once)]})
    assert titles(draw_figure(moment)) == ["arm"]


@pytest.mark.slow
@pytest.mark.parametrize("suffix", FIGURE_SUFFIXES)
def test_markup_in_names_is_drawn_as_text(suffix: str, tmp_path: Path) -> None:
    odd = "a $_{x$ & <b> \\frac"
    times = np.linspace(0.0, 5.0, 50)
    data = replace(
        cell(),
        title=odd,
        note=odd,
        joints={odd: [JointTrack(odd, "rad", times, times)]},
        marks=[Mark(1.0, odd)],
        states={odd: [Span(0.0, 60.0, odd)]},
    )

    write_figure(draw_figure(data), tmp_path / f"odd{suffix}")

    assert (tmp_path / f"odd{suffix}").stat().st_size > 1000


@pytest.mark.slow
@pytest.mark.parametrize("suffix", FIGURE_SUFFIXES)
def test_file_has_format_of_suffix_and_is_reproducible(suffix: str, tmp_path: Path) -> None:
    begins = {".png": b"\x89PNG", ".svg": b"<?xml", ".pdf": b"%PDF"}
    written = []
    for name in ("one", "two"):
        path = tmp_path / f"{name}{suffix}"
        write_figure(draw_figure(cell(), ["score", "trays"]), path)
        written.append(path.read_bytes())
    assert written[0].startswith(begins[suffix])
    assert written[0] == written[1]


def test_long_name_is_complete_and_widens_page(tmp_path: Path) -> None:
    name = "right_shoulder_and_elbow_actuator_joint_of_the_second_arm"
    times = np.linspace(0.0, 60.0, 50)
    data = replace(
        cell(),
        joints={"arm": [JointTrack(name, "rad", times, times)]},
        commands=[CommandTrack(f"/ariac/{name}", times)],
    )
    for path, drawn in ((tmp_path / "long.svg", data), (tmp_path / "short.svg", cell())):
        write_figure(draw_figure(drawn, ["joints", "commands"]), path)

    wide, usual = ((tmp_path / each).read_text() for each in ("long.svg", "short.svg"))

    assert wide.count(f">{name}<") == 2
    assert width(wide) > width(usual) + 72
    assert width(usual) == pytest.approx(8.27 * 72, abs=0.1)


def width(svg: str) -> float:
    """Return the width of a picture [pt]."""
    (found,) = re.findall(r'<svg[^>]* width="([0-9.]+)pt"', svg)
    return float(found)


def test_very_long_title_is_shortened_in_middle(tmp_path: Path) -> None:
    write_figure(draw_figure(replace(cell(), title="a" * 300 + "b" * 300), ["score"]), tmp_path / "a.svg")
    assert f">{'a' * 99}…{'b' * 99}<" in (tmp_path / "a.svg").read_text()


def test_missing_folder_is_refused(tmp_path: Path) -> None:
    with pytest.raises(OSError, match="No such file"):
        write_figure(draw_figure(cell(), ["score"]), tmp_path / "nowhere" / "a.png")
