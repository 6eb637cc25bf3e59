"""The pytest plugin in a project of its own: fixtures, markers, shared runs and reports."""

from __future__ import annotations

import re
import tomllib
from importlib import import_module
from pathlib import Path

import pytest

from tests.running.pytest_project import PLUGIN, run_pytest

ROOT = Path(__file__).parents[2]

pytestmark = pytest.mark.slow


def project(folder: Path, text: str) -> Path:
    """Write a project with one file of tests."""
    (folder / "pytest.ini").write_text("[pytest]\naddopts = --strict-markers\nfilterwarnings = error\n")
    (folder / "test_it.py").write_text(f"import pytest\n{text}")
    return folder


def test_entry_point_is_the_plugin() -> None:
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["entry-points"]["pytest11"]
    assert declared == {"cellwright": PLUGIN}
    assert import_module(PLUGIN).recording


def test_tests_with_equal_markers_share_a_run(tmp_path: Path) -> None:
    text = """
pytestmark = pytest.mark.trial("lesson", until=0.2)

def test_run(run):
    assert (run.outcome.name, run.simulated) == ("UNTIL", 0.2)

def test_recording(recording):
    assert (recording.name, recording.end) == ("lesson", 0.2)

@pytest.mark.trial("lesson", until=0.3)
def test_other(recording):
    assert recording.end == 0.3

def test_cell(cell):
    assert cell.simulation.time == 0.0
    cell.step()
    assert cell.simulation.time == 0.002
"""
    done = run_pytest(project(tmp_path, text), "-q")
    assert "4 passed" in done.stdout, done.stdout
    assert len(list(tmp_path.glob("made/**/*.mcap"))) == 2


def test_seeds_repeat_a_test_with_runs_of_their_own(tmp_path: Path) -> None:
    text = """
@pytest.mark.trial("lesson", until=0.1)
@pytest.mark.seeds(3, 5)
def test_seed(recording, run, trial_seed):
    assert recording.header["seed"] == trial_seed

@pytest.mark.trial("lesson")
@pytest.mark.seeds(5)
def test_cell(cell):
    assert cell.seed == 5
"""
    done = run_pytest(project(tmp_path, text), "-v")
    assert re.findall(r"(test_\w+\[\d\]) PASSED", done.stdout) == ["test_seed[3]", "test_seed[5]", "test_cell[5]"]
    assert len(list(tmp_path.glob("made/**/*.mcap"))) == 2


def test_agent_of_marker_works_and_fixtures_of_the_project_go_first(tmp_path: Path) -> None:
    text = """
class Starter:
    def run(self, client):
        client.start_competition()
        client.sleep(0.2)
        client.end_competition()

@pytest.fixture
def run():
    return "mine"

@pytest.mark.trial("lesson", agent=Starter)
def test_states(run, recording):
    assert run == "mine"
    assert recording.header["agent"] == "Starter"
    assert recording.span("competition go").begin < 0.2
"""
    done = run_pytest(project(tmp_path, text), "-q")
    assert "1 passed" in done.stdout, done.stdout


def test_marker_joins_files_sets_values_and_varies(tmp_path: Path) -> None:
    text = """
from cellwright.config.trial.catalogue import find_trial

more = pytest.mark.trial(["final01", "kitter_sensors"], vary=True, set="time_limit=60", servo="precise")

@more
@pytest.mark.seeds(1, 2)
def test_cell(cell, trial_seed):
    assert (cell.trial.has_arm, cell.trial.time_limit, cell.servo, cell.seed) == (True, 60.0, "precise", trial_seed)

@pytest.mark.trial("final01", files="kitter_sensors", until=0.1, set=["time_limit=60"])
def test_files(recording, run):
    assert [name.rpartition("/")[2] for name in recording.header["files"]] == ["final01.yaml", "kitter_sensors.yaml"]
    assert recording.header["overrides"] == ["time_limit=60"]

poses = {}

@pytest.mark.trial("final01+kitter_sensors", vary=True)
@pytest.mark.seeds(1, 2)
def test_seeds_vary(cell, trial_seed):
    poses[trial_seed] = [part.pose for part in cell.trial.bin_parts]

def test_they_differed():
    assert poses[1] != poses[2]
"""
    done = run_pytest(project(tmp_path, text), "-q")
    assert "6 passed" in done.stdout, done.stdout


def test_failed_test_names_its_recording(tmp_path: Path) -> None:
    text = """
@pytest.mark.trial("lesson", until=0.1)
def test_bins(recording):
    assert recording.clearance("forearm_link", "bin?").distance > 100.0
"""
    done = run_pytest(project(tmp_path, text), "-q")
    assert done.returncode == 1
    (made,) = tmp_path.glob("made/**/*.mcap")
    assert f"cellwright replay {made} --view" in done.stdout
    assert "Clearance(distance=" in done.stdout


@pytest.mark.parametrize(
    ("marks", "error"),
    [
        ("", "no trial is chosen"),
        ("@pytest.mark.trial('lesso', until=0.1)", "did you mean lesson"),
        ("@pytest.mark.trial('lesson', untill=0.1)", "unexpected keyword argument 'untill'"),
        ("@pytest.mark.trial('lesson', servo='exact', until=0.1)", r"servo must be one of .* \(got 'exact'\)"),
        ("@pytest.mark.trial('lesson', set='time_limi=5', until=0.1)", "did you mean time_limit"),
        ("@pytest.mark.trial(cellwright.Trial('x'), files='lesson')", "need a trial by name or file"),
        ("@pytest.mark.trial('lesson', agent=Crashing)", r"the agent crashed at 0 s\n(?s:.*)no such bin"),
        ("@pytest.mark.trial('lesson')", "a run without an agent needs an end"),
        ("@pytest.mark.seeds('1')\n@pytest.mark.trial('lesson')", r"seeds must be whole numbers \(got \('1',\)\)"),
    ],
)
def test_mistake_fails_the_test_with_a_remedy(marks: str, error: str, tmp_path: Path) -> None:
    text = f"""
import cellwright

class Crashing:
    def run(self, client):
        raise RuntimeError("no such bin")

{marks}
def test_it(recording):
    pass
"""
    done = run_pytest(project(tmp_path, text), "-q")
    assert done.returncode != 0
    assert re.search(error, done.stdout + done.stderr), done.stdout + done.stderr


def test_seeds_without_a_fixture_are_refused(tmp_path: Path) -> None:
    done = run_pytest(project(tmp_path, "@pytest.mark.seeds(1)\ndef test_it(): pass\n"), "-q")
    assert done.returncode != 0
    assert "test_it.py::test_it: seeds has no effect" in done.stdout + done.stderr


def test_plugin_loads_nothing_before_a_test_needs_a_run(tmp_path: Path) -> None:
    text = """
import sys

def test_it():
    loaded = [name for name in sys.modules if name.startswith("cellwright.")]
    assert sorted(loaded) == ["cellwright._package", "cellwright.running", "cellwright.running.pytest_plugin"]
    assert "numpy" not in sys.modules
"""
    done = run_pytest(project(tmp_path, text), "-q", is_fresh=True)
    assert "1 passed" in done.stdout, done.stdout
