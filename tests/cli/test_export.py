"""Tests of the command `export`."""

import json
from pathlib import Path

import pytest
from pyarrow import parquet

from tests.cli.conftest import CommandLine
from tests.recording.dataset.made import kitted
from tests.recording.dataset.sets import DATA, change_table, write


@pytest.mark.slow
def test_recorded_run_becomes_a_set_that_the_check_accepts(cellwright: CommandLine) -> None:
    cellwright("run", "pick_from_bin", "--agent", "none", "--until", "0.5", "--no-picture", "--record", "run.mcap")
    ran = cellwright("export", "run.mcap", "run.mcap", "--out", "picks", "--cameras", "overhead,wrist")
    assert ran.out == "episode     1 of 2, 10 frames so far\nepisode     2 of 2, 20 frames so far\ndata set    picks\n"
    assert (ran.status, ran.err) == (0, "")
    info = json.loads(Path("picks/meta/info.json").read_text())
    assert (info["fps"], info["total_episodes"], info["total_frames"]) == (20, 2, 20)
    assert {"observation.images.overhead", "observation.images.wrist", "action"} <= {*info["features"]}
    checked = cellwright("export", "--check", "picks")
    assert (checked.status, checked.out) == (0, "ok\n")


@pytest.mark.slow
def test_check_with_recordings_replays_the_actions(cellwright: CommandLine) -> None:
    kitted(Path("run.mcap"))
    cellwright("export", "run.mcap", "--out", "picks")
    checked = cellwright("export", "run.mcap", "--check", "picks")
    assert (checked.status, checked.out) == (0, "ok\nreplayed    1 of 1 successes succeed again\n")
    cellwright("run", "lesson", "--agent", "none", "--until", "0.1", "--no-picture", "--record", "other.mcap")
    other = cellwright("export", "run.mcap", "other.mcap", "--check", "picks")
    assert other.status == 2
    assert "other.mcap: is the recording of no episode of picks (got SHA-256 " in other.err


def test_recording_becomes_a_table(cellwright: CommandLine) -> None:
    cellwright("run", "lesson", "--agent", "none", "--until", "0.1", "--no-picture", "--record", "run.mcap")
    ran = cellwright("export", "run.mcap", "--out", "run.parquet", "--hz", "50")
    assert (ran.status, ran.out, ran.err) == (0, "table       run.parquet, 5 rows\n", "")
    assert parquet.read_table("run.parquet")["time"].to_pylist() == pytest.approx([0.0, 0.02, 0.04, 0.06, 0.08])


def test_stopped_export_says_how_to_go_on(cellwright: CommandLine) -> None:
    rest = ("--agent", "none", "--until", "0.1", "--no-picture", "--record")
    cellwright("run", "pick_from_bin", *rest, "run.mcap")
    cellwright("run", "lesson", *rest, "other.mcap")
    ran = cellwright("export", "run.mcap", "other.mcap", "--out", "picks")
    assert ran.status == 2
    assert "unfinished  .picks.part; the same command goes on from there\n" in ran.err
    assert "sentence: lesson has no task that says one" in ran.err


def test_check_prints_problems_and_exits_with_1(cellwright: CommandLine) -> None:
    folder = write(Path("damaged"))
    change_table(folder / DATA, lambda table: table.drop_columns(["action"]))
    ran = cellwright("export", "--check", "damaged")
    assert (ran.status, ran.out) == (1, f"damaged/{DATA}: action: column is missing\n")


@pytest.mark.parametrize(
    ("arguments", "text"),
    [
        ((), "export: give recordings and --out FOLDER, or --check FOLDER"),
        (("run.mcap",), "export: give recordings and --out FOLDER, or --check FOLDER"),
        (("--check", "set", "--out", "other"), "--check: takes no --out; check the folder alone, or with its"),
        (("run.mcap", "--out", "set"), "run.mcap"),
        (
            ("a.mcap", "b.mcap", "--out", "t.parquet"),
            "--out t.parquet: a table is of one recording of Cellwright (got 2",
        ),
        (
            ("run.bag", "--out", "t.parquet"),
            "t.parquet: a table is of one recording of Cellwright (got the bag run.bag)",
        ),
        (("run.mcap", "--out", "t.parquet", "--sentence", "Pick."), "--sentence: is for data sets; leave it out"),
        (("run.mcap", "--out", "none/t.parquet"), "--out none/t.parquet: there is no folder none"),
    ],
    ids=["nothing", "no-folder", "both", "missing", "tables", "bag", "sentence", "no-place"],
)
def test_bad_input_is_refused(cellwright: CommandLine, arguments: tuple[str, ...], text: str) -> None:
    ran = cellwright("export", *arguments)
    assert ran.status == 2
    assert text in ran.err
    assert not Path("set").exists()


def test_missing_package_is_named_with_its_extra(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellwright.cli.export.is_installed", lambda name: name != "av")
    ran = cellwright("export", "--check", "set")
    assert ran.status == 2
    assert "export: needs the package av; pip install 'cellwright[parquet,video]'" in ran.err


def test_table_needs_one_package_alone(cellwright: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cellwright.cli.export.is_installed", lambda _name: False)
    ran = cellwright("export", "run.mcap", "--out", "run.parquet")
    assert ran.status == 2
    assert "export: needs the package pyarrow; pip install 'cellwright[parquet]'" in ran.err
