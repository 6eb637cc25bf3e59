"""Tests of tables: at 80 columns each fits, and no cell is broken in the middle of a word or number."""

import json
import re
from collections.abc import Iterable, Sequence
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rich.console import Console
from rich.text import Text

from cellwright.cell.kitting.kit_score import Fit, PartFinding, Verdict
from cellwright.cli import tables
from cellwright.cli.eval.conclusion import show_summary
from cellwright.cli.eval.progress import EvalProgress
from cellwright.cli.operate.signal import figures_table
from cellwright.cli.replay.actions import show_contents
from cellwright.cli.robot import show_robot
from cellwright.cli.summary import kit_table
from cellwright.cli.teleop.checks import findings_table
from cellwright.config.robot.robots import load_robot
from cellwright.robot.checks.rig import Finding, MotionReport
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.summary import summary_document
from cellwright.util.pose import Pose
from tests.cli.conftest import CommandLine
from tests.cli.test_summary import kit
from tests.clients.operators.test_plots import done
from tests.running.evaluation.made_results import worked

WIDTH = 80
TRIAL = "final_with_hydraulic_manifolds+kitter_sensors cellwright.arm.dry_friction.elbow_joint=0.0125"
BELT = "warehouse-qualifier/second_round options.belt_population_cycles=120"
_WORD = re.compile(r"[+-]?\d[\d.]*(?:e[+-]?\d+)?|[^\W\d_]+")


def lines_of(table: tables.FittedTable, width: int = WIDTH) -> list[str]:
    console = Console(file=StringIO(), width=width, highlight=False)
    tables.print_table(console, table)
    text: str = console.file.getvalue()  # type: ignore[attr-defined]
    return text.splitlines()


def check(lines: Sequence[str], cells: Iterable[str], width: int = WIDTH) -> None:
    """Check that a screen has each word and number of the cells on one line, and is no wider than the console."""
    shown = {word for line in lines for word in _WORD.findall(line)}
    assert {word for cell in cells for word in _WORD.findall(cell)} - shown == set()
    assert max(map(len, lines)) <= width
    assert "\N{HORIZONTAL ELLIPSIS}" not in "".join(lines)


def test_table_has_columns_and_rows() -> None:
    out = StringIO()
    columns = {"name": tables.FOLD, "figure": tables.RIGHT, "more": tables.WHOLE}
    tables.print_table(Console(file=out, width=40), tables.table(columns, [("a", "1", "x y"), ("b", "22")]))
    lines = [line.rstrip() for line in out.getvalue().splitlines()]
    assert lines[0].split() == ["name", "figure", "more"]
    assert [line.split() for line in lines[2:]] == [["a", "1", "x", "y"], ["b", "22"]]
    assert lines[2].index("1") == lines[3].index("22") + 1


@pytest.mark.parametrize(
    ("cell", "width", "lines"),
    [
        ("final01+kitter_sensors", 10, ["final01+", "kitter_", "sensors"]),
        ("lesson arm.friction=-0.25 n=1e+3", 14, ["lesson arm.", "friction=-0.25", "n=1e+3"]),
        ("3 done, 12 time limit", 10, ["3 done,", "12 time", "limit"]),
        ("belt|gear_part_1", 11, ["belt|", "gear_part_1"]),
        ("a_b\n\nc", 3, ["a_b", "", "c"]),
        ("inseparable", 4, ["inseparable"]),
    ],
)
def test_cell_is_broken_between_words_only(cell: str, width: int, lines: list[str]) -> None:
    table = tables.table({"x": tables.FOLD}, [[cell]], box=None, show_header=False)
    assert lines_of(table, width) == lines


def test_table_that_cannot_fit_is_wider_than_console() -> None:
    table = tables.table({"n": tables.FOLD, "figure": tables.RIGHT}, [["inseparable", "123456.789"]])
    assert lines_of(table, 12)[-1].split() == ["inseparable", "123456.789"]


def test_heading_is_broken_before_cells_are() -> None:
    table = tables.table({"a name": tables.FOLD, "turn mrad": {"justify": "right"}}, [["piston_rod", "1"]])
    lines = lines_of(table, 20)
    assert "piston_rod" in lines[-1]
    assert "turn mrad" not in "".join(lines)


def test_styles_outlive_a_break() -> None:
    table = tables.table({"x": tables.FOLD}, [[Text("one_two", "red")]], box=None, show_header=False)
    console = Console(file=StringIO(), width=4, force_terminal=True, color_system="standard")
    tables.print_table(console, table)
    assert console.file.getvalue().count("\x1b[31m") == 2  # type: ignore[attr-defined]


NAMES = st.lists(st.sampled_from(["gear", "hydraulic", "a", "x=-0.125", "part", "n=1e-06"]), min_size=1, max_size=9)


@settings(max_examples=40)
@given(st.lists(st.tuples(NAMES, st.sampled_from(["_", "=", " ", "|"]), st.floats(-1e9, 1e9)), min_size=1, max_size=4))
def test_any_names_fit_whole(rows: list[tuple[list[str], str, float]]) -> None:
    cells = [[sign.join(name), f"{figure:.4g}", " ".join(name)] for name, sign, figure in rows]
    table = tables.table({"name": tables.FOLD, "figure": tables.RIGHT, "more": tables.FOLD}, cells)
    check(lines_of(table, 50), (cell for row in cells for cell in row), 50)


def runs(*, lose: float = 0.0) -> list[Result]:
    """Return runs of two trials of long names, one of a sweep, with several outcomes."""
    outcomes = ("done", "time_limit", "wall_limit", "crashed")
    return [
        worked(seed * 1.25 - lose, seed=seed, vary=True, trial=trial, outcome=outcomes[seed % 4], reason="late")
        for trial in (TRIAL, BELT)
        for seed in range(1, 9)
    ]


def test_tables_of_evaluation_break_no_word() -> None:
    console = Console(file=StringIO(), width=WIDTH, highlight=False)
    show_summary(console, runs(), None)
    lines = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    end = next(number for number, line in enumerate(lines) if line.startswith("  "))
    check(lines[1:end], [TRIAL, BELT, "2 done, 2 time limit, 2 wall limit, 2 crashed", "5.625", "1.25", "time, s"])


def test_tables_of_comparison_break_no_word(cellwright: CommandLine) -> None:
    for name, results in (("old", runs()), ("new", runs(lose=1.25))):
        Path(name).mkdir()
        (Path(name) / "summary.json").write_text(json.dumps(summary_document(results, None, 0)))
    lines = cellwright("eval", "compare", "old", "new").out.splitlines()
    begin = lines.index("") + 1
    end = next(n for n, line in enumerate(lines) if n > begin and " seed " in line)
    check(lines[begin:end], [TRIAL, BELT, "pairs", "better", "worse", "-1.25", "5.625", "4.375", "time, s"])


def test_moving_tables_of_evaluation_break_no_word() -> None:
    trial = SimpleNamespace(name=TRIAL, time_limit=500.0)
    job: Any = SimpleNamespace(trial=trial, name=f"{TRIAL} seed 17", agent="kitter")
    console = Console(file=StringIO(), width=WIDTH, highlight=False)
    progress = EvalProgress(console, [job])
    progress._results = runs()[:8]
    running: Any = SimpleNamespace(job=job, simulated=123.4, points=4.5, wall=61.0)
    progress.show_jobs([running])
    console.print(progress._table())
    lines = [line.rstrip() for line in console.file.getvalue().splitlines()]  # type: ignore[attr-defined]
    check(lines, [f"{TRIAL} seed 17", "123 of 500 s", "4.5 points", "61 s", "5.625", "8/1", "47%"])


def test_kit_table_breaks_no_word() -> None:
    name = "populate_conveyor|hydraulic_manifold_bracket_left_part_clone_1234"
    found = PartFinding("hydraulic_manifold_bracket_part", Pose(), Verdict.TOO_FAR, Fit(name, 123.4567, 0.99, 3.1))
    check(lines_of(kit_table(kit(found))), [name, found.type, "123456.7", "3100", "too far"])


def test_motion_check_and_test_signals_break_no_word() -> None:
    name = "left_hand_index_finger_distal_phalanx_flexion_joint"
    finding = Finding(f"{name}, step 0 to 1.25", 16.53, 5.0, "mm late", "0.050 s, after 12 samples", False, "", "")
    check(lines_of(findings_table(MotionReport("shy", "", (finding,)))), [finding.what, "5 mm", finding.where])
    check(lines_of(figures_table([done(name)])), [name, "overshoot", "settling"])


@pytest.mark.parametrize("robot", ["qinglong", "tandem"])
def test_table_of_robot_breaks_no_word(
    robot: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    config = load_robot(robot, print)
    monkeypatch.setattr("cellwright.cli.robot._console", lambda: Console(width=WIDTH, highlight=False))
    show_robot(config)
    lines = capsys.readouterr().out.splitlines()
    joints = config.robot.joints
    numbers = [f"{round(joint.limits.upper, 3):.4g}" for joint in config.robot.driven]
    table = lines[2 : lines.index("", 3)]
    check(table, [joint.name for joint in joints] + [joint.child for joint in joints] + numbers)


def test_lists_of_trials_and_robots_break_no_word(cellwright: CommandLine) -> None:
    for command in ("trials", "robot"):
        lines = cellwright(command).out.splitlines()
        assert max(map(len, lines)) <= WIDTH
    shown = " ".join(cellwright("trials").out.split())
    assert "order_1 is announced when a part that it wants is on a tray" in shown


def test_topics_of_recording_break_no_word(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    cellwright("run", "lesson", "--agent", "none", "--until", "0.2", "--no-picture", "--record", "a.mcap")
    contents = json.loads(cellwright("replay", "a.mcap", "--json").out)
    topics = [each["name"] for each in contents["topics"] if each["messages"] and not each["own"]]
    console = Console(file=StringIO(), width=WIDTH, highlight=False)
    monkeypatch.setattr(Console, "is_terminal", True)  # through a pipe the table is as wide as it needs to be
    show_contents(console, contents)
    lines = console.file.getvalue().splitlines()  # type: ignore[attr-defined]
    check(lines[2 : lines.index("", 3)], topics)
