"""Tests of `cellwright eval`, from its arguments to its files."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import pytest

from cellwright.cli.eval import command, conclusion
from cellwright.cli.main import main
from cellwright.recording.format.reader import RecordingFile
from cellwright.running.evaluation.execution.local import LocalRunner
from tests.cli.conftest import CommandLine
from tests.running.evaluation.programs import PROGRAMS, TRIAL
from tests.support.quick_children import QUICK_WORKERS


@pytest.fixture
def tiny(cellwright: CommandLine) -> CommandLine:
    Path("tiny.yaml").write_text(TRIAL)
    Path("programs.py").write_text(PROGRAMS)
    Path("sensors.yaml").write_text("sensors: {beam: {type: break_beam, pose: {xyz: [1, 2, 1]}}}\n")
    return cellwright


@QUICK_WORKERS
@pytest.mark.slow
def test_only_recordings_of_failures_are_kept(tiny: CommandLine) -> None:
    work = ("eval", "tiny.yaml", "--agent", "programs.py:Deliver", "--jobs", "1", "--record-failed")
    recordings = Path("evaluation/recordings")
    assert tiny(*work, "--min-score", "6").status == 0
    assert list(recordings.iterdir()) == []
    assert tiny(*work, "--min-score", "7", "--fresh").status == 1
    (kept,) = recordings.iterdir()
    with RecordingFile(kept) as recording:
        assert recording.is_complete
    ran = tiny(*work, "--record")
    assert (ran.status, ran.err) == (2, "error: --record keeps all recordings; leave out it or --record-failed\n")


@QUICK_WORKERS
@pytest.mark.slow
def test_good_agent_passes_and_resumes(tiny: CommandLine) -> None:
    work = ("eval", "tiny.yaml", "--agent", "programs.py:Deliver", "--jobs", "1")
    ran = tiny(*work, "--min-score", "100%", "--record")
    assert (ran.status, ran.err) == (0, "")
    assert "[1/1] tiny seed 1: 6 of 6 points, done, " in ran.out
    assert "passed      1 of 1 runs" in ran.out
    folder = Path("evaluation")
    assert {path.name for path in folder.iterdir()} - {"states"} == {  # a short run may have no live state
        "junit.xml",
        "logs",
        "plan.json",
        "recordings",
        "report.html",
        "results.jsonl",
        "summary.json",
    }
    assert ElementTree.fromstring((folder / "junit.xml").read_bytes()).get("failures") == "0"
    assert json.loads((folder / "summary.json").read_text())["exit_status"] == 0
    assert "tiny seed 1" in (folder / "report.html").read_text(encoding="utf-8")
    (recorded,) = (folder / "recordings").iterdir()
    with RecordingFile(recorded) as recording:
        assert recording.end is not None
        assert (recording.end["score"], recording.header.facts["agent"]) == (6.0, "programs.py:Deliver")
        assert recording.header.facts["files"][0] == "files/tiny.yaml"
        assert set(recording.sources) == set(recording.header.facts["files"])
    again = tiny(*work, "--min-score", "7", "--json")
    assert again.status == 1
    assert "1 of them has a result already" in again.err
    document = json.loads(again.out)
    assert document["results"][0]["shortcoming"] == "6 of 6 points, below the required 7 points"
    assert ElementTree.fromstring((folder / "junit.xml").read_bytes()).get("failures") == "1"


@QUICK_WORKERS
@pytest.mark.slow
def test_repeat_finds_programs_that_are_not_repeatable(tiny: CommandLine) -> None:
    work = ("eval", "tiny.yaml", "--jobs", "1", "--repeat", "--json", "--out")
    ran = tiny(*work, "good", "--agent", "programs.py:Deliver")
    assert ran.status == 0
    assert "2 runs, agent programs.py:Deliver" in ran.err
    assert "repeated    1 of 1 runs ended in the same state" in ran.err
    (repeat,) = json.loads(ran.out)["repeats"]
    assert (repeat["difference"], len(set(repeat["state_hashes"]))) == ("", 1)
    assert ElementTree.parse("good/junit.xml").getroot().get("tests") == "2"
    ran = tiny(*work, "bad", "--agent", "programs.py:Learn")
    assert ran.status == 1
    assert "tiny seed 1 is not repeatable: state " in ran.err
    document = json.loads(ran.out)
    assert (document["runs"], document["passed"], document["exit_status"]) == (1, 1, 1)
    assert len(set(document["repeats"][0]["state_hashes"])) == 2
    (failure,) = ElementTree.parse("bad/junit.xml").getroot().iter("failure")
    assert (failure.get("message") or "").startswith("not repeatable: state ")
    assert "tiny seed 1: state " in Path("bad", "report.html").read_text(encoding="utf-8")


@QUICK_WORKERS
@pytest.mark.slow
def test_fresh_runs_again_what_has_a_result(tiny: CommandLine) -> None:
    work = ("eval", "tiny.yaml", "--agent", "programs.py:Noted")
    for options, runs in (((), 1), ((), 1), (("--fresh",), 2), ((), 2)):
        assert tiny(*work, *options).status == 0
        assert Path("notes.txt").read_text().count("run") == runs
    assert len(Path("evaluation", "results.jsonl").read_text().splitlines()) == 2


@QUICK_WORKERS
@pytest.mark.slow
def test_agent_that_crashes_in_one_of_two_trials_fails(tiny: CommandLine) -> None:
    Path("other.yaml").write_text(f"{TRIAL}\ntime_limit: 1\n")
    ran = tiny("eval", "tiny.yaml", "other.yaml", "--with", "sensors.yaml", "--agent", "programs.py:Crash", "--json")
    assert ran.status == 1
    assert [each["trial"] for each in json.loads(ran.out)["results"]] == ["tiny", "other"]
    assert "tiny seed 1: LookupError" in ran.err


@QUICK_WORKERS
@pytest.mark.slow
def test_trial_without_arm_gets_bundled_arm(tiny: CommandLine) -> None:
    look = "print('/ariac/logical_camera_belt' in client.transport.topics())"
    Path("looks.py").write_text(f"class Looks:\n    def run(self, client):\n        {look}\n")
    assert tiny("eval", "tiny.yaml", "--agent", "looks.py:Looks").status == 1
    (log,) = Path("evaluation", "logs").glob("tiny-*.log")
    assert log.read_text() == "True\n"
    assert tiny("eval", "tiny.yaml", "--agent", "looks.py:Looks", "--with", "sensors.yaml", "--out", "b").status == 1
    (log,) = Path("b", "logs").glob("tiny-*.log")
    assert log.read_text() == "False\n"


@QUICK_WORKERS
@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no.yaml"], "no.yaml: there is no such file"),
        (["nothing"], "unknown trial 'nothing'"),
        (["tiny.yaml", "--agent", "programs.py:Missing"], "unknown class 'Missing'"),
        (["tiny.yaml", "--agent", "programs.py:CannotBeMade"], "cannot be made: OSError: no map found"),
        (["tiny.yaml", "--min-score", "much"], "--min-score much: give points"),
        (["tiny.yaml", "--time-limit", "0"], "--time-limit 0: give a number from 0.1"),
        (["tiny.yaml", "--memory-limit", "nan"], "--memory-limit nan: give a number from 256"),
        (["tiny.yaml", "--seeds", "0"], "--seeds 0: give a number from 1"),
        (["tiny.yaml", "--seeds", "few"], "--seeds few: is no number of seeds and no file"),
        (["tiny.yaml", "--jobs", "0"], "--jobs 0: give a number from 1"),
        (["tiny.yaml", "--out", "tiny.yaml"], "--out tiny.yaml: cannot be written"),
        ([], "Missing argument"),
    ],
)
def test_invalid_input_starts_nothing(arguments: list[str], message: str, tiny: CommandLine) -> None:
    ran = tiny("eval", *arguments)
    assert ran.status == 2
    assert message in ran.err
    assert "[1/1]" not in ran.out


@QUICK_WORKERS
@pytest.mark.slow
def test_trials_of_same_name_are_distinguished(tiny: CommandLine) -> None:
    for folder in ("a", "b"):
        Path(folder).mkdir()
        Path(folder, "tiny.yaml").write_text(f"{TRIAL}\ntime_limit: {ord(folder)}\n")
    ran = tiny("eval", "a/tiny.yaml", "b/tiny.yaml", "a/tiny.yaml", "--agent", "programs.py:GiveUp", "--json")
    assert [each["trial"] for each in json.loads(ran.out)["trials"]] == ["a/tiny.yaml", "b/tiny.yaml"]


@QUICK_WORKERS
@pytest.mark.slow
def test_trial_without_order_is_neither_a_pass_nor_counted(tiny: CommandLine) -> None:
    Path("empty.yaml").write_text("arm: {type: ur10}\ntime_limit: 1\n")
    ran = tiny("eval", "empty.yaml", "--agent", "programs.py:Deliver", "--json")
    assert ran.status == 3
    document = json.loads(ran.out)
    (run,) = document["results"]
    assert (run["outcome"], run["passed"], run["shortcoming"]) == ("no_order", False, "the trial has no order")
    assert (document["passed"], document["unjudged"], document["share"]) == (0, 1, None)
    assert "passed      0 of 0 runs" in ran.err
    assert "not judged, and not counted: empty" in ran.err
    junit = ElementTree.fromstring(Path("evaluation", "junit.xml").read_bytes())
    assert (junit.get("failures"), junit.get("skipped")) == ("0", "1")
    assert junit.find(".//skipped") is not None
    assert "not judged" in Path("evaluation", "report.html").read_text(encoding="utf-8")


def test_file_without_order_beside_a_trial_is_refused_with_the_joined_name(tiny: CommandLine) -> None:
    ran = tiny("eval", "tiny.yaml", "sensors.yaml", "--agent", "programs.py:Deliver")
    assert (ran.status, Path("evaluation").exists()) == (2, False)
    assert ran.err == (
        "error: sensors.yaml: has no order, and is no trial beside others; to join it, write such as "
        "tiny.yaml+sensors.yaml\n"
    )


@QUICK_WORKERS
@pytest.mark.slow
def test_joined_files_are_one_trial_with_a_command_that_repeats_it(tiny: CommandLine) -> None:
    Path("limit.yaml").write_text("time_limit: 77\n")
    ran = tiny("eval", "tiny.yaml+limit.yaml", "tiny.yaml", "--agent", "programs.py:GiveUp", "--json")
    joined, alone = json.loads(ran.out)["results"]
    assert (joined["trial"], alone["trial"]) == ("tiny.yaml+limit.yaml", "tiny.yaml")
    assert joined["command"].startswith("cellwright run tiny.yaml+limit.yaml+kitter_sensors --agent ")
    again = tiny(*joined["command"].split()[1:], "--no-picture", "--json")
    assert json.loads(again.out)["state_hash"] == joined["state_hash"]


def test_help_lists_every_exit_status() -> None:
    assert main(["eval", "--help"]) == 0


@pytest.mark.parametrize("command", ["eval", "run"])
@pytest.mark.parametrize("second", [("--agent", "lesson"), ("--agent=lesson",)])
def test_agent_that_is_given_twice_is_refused(tiny: CommandLine, command: str, second: tuple[str, ...]) -> None:
    ran = tiny(command, "tiny.yaml", "--agent", "kitter", *second)
    message = "error: --agent: given twice; run one program at a time, and see `cellwright eval compare`\n"
    assert (ran.status, ran.out, ran.err) == (2, "", message)
    assert not Path("evaluation").exists()


def test_other_transport_of_an_evaluation_is_refused(tiny: CommandLine) -> None:
    ran = tiny("eval", "tiny.yaml", "--over", "ros1")
    assert (ran.status, ran.err) == (2, "error: --over ros1: give socket\n")


@QUICK_WORKERS
@pytest.mark.slow
def test_protected_results_are_runs_of_their_own_and_the_report_says_what_it_relies_on(tiny: CommandLine) -> None:
    work = ("eval", "tiny.yaml", "--agent", "programs.py:Deliver")
    report = Path("evaluation", "report.html")
    assert tiny(*work).status == 0
    assert "The program ran in the referee's process" in report.read_text(encoding="utf-8")
    ran = tiny(*work, "--over", "socket", "--verify")
    assert (ran.status, "have a result" in ran.out) == (0, False)
    words = "The program ran in a process of its own and its commands alone gave the same result."
    assert words in report.read_text(encoding="utf-8")
    assert "1 of them has a result already" in tiny(*work, "--over", "socket", "--verify").out
    edited = Path("evaluation", "results.jsonl")
    edited.write_bytes(edited.read_bytes().replace(b'"points":6.0', b'"points":5.0'))
    ran = tiny(*work)
    assert ran.status == 0
    assert ran.out.count("it was changed after it was written; this line is not believed") == 2
    assert "[1/1] tiny seed 1: 6 of 6 points" in ran.out


def interrupted(*_: object, **_more: object) -> None:
    """Stand-in for a step in which Ctrl-C comes."""
    raise KeyboardInterrupt


def ended(*_: object, **_more: object) -> None:
    """Stand-in for a step in which a service manager ends the command."""
    assert signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL, "the tests would end too"
    signal.raise_signal(signal.SIGTERM)


@pytest.mark.parametrize(
    "come",
    [
        interrupted,
        pytest.param(ended, marks=pytest.mark.skipif(sys.platform == "win32", reason="no such signal there")),
    ],
)
def test_signal_while_the_agent_is_checked_leaves_all_runs(
    come: Callable[..., None], tiny: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(LocalRunner, "check_agent", come)
    ran = tiny("eval", "tiny.yaml", "--agent", "programs.py:Deliver", "--seeds", "20", "--out", "c8")
    assert ran.out == "20 runs, agent programs.py:Deliver, results in c8\n"
    assert (ran.status, ran.err) == (75, "interrupted; repeat the command to continue\n")


def test_ctrl_c_while_a_class_begins_leaves_all_runs(tiny: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(LocalRunner, "run", interrupted)
    ran = tiny("eval", "tiny.yaml", "--agents", "programs.py:Deliver")
    assert ran.out == "1 run, 1 programs, results in evaluation\n"
    assert (ran.status, ran.err) == (75, "interrupted; repeat the command to continue\n")


@QUICK_WORKERS
@pytest.mark.slow
def test_ctrl_c_while_files_are_written_leaves_them_for_the_same_command(
    tiny: CommandLine, monkeypatch: pytest.MonkeyPatch
) -> None:
    work = ("eval", "tiny.yaml", "--agent", "programs.py:Deliver")
    with monkeypatch.context() as patch:
        patch.setattr(conclusion, "draw_worst", interrupted)
        assert tiny(*work).status == 75
    assert tiny(*work).status == 0


def test_ctrl_c_before_the_plan_starts_nothing(tiny: CommandLine, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(command, "make_jobs", interrupted)
    ran = tiny("eval", "tiny.yaml")
    assert (ran.status, ran.out, ran.err) == (130, "", "interrupted\n")
    assert not Path("evaluation").exists()


def written() -> dict[str, bytes]:
    """Return the content of each file of the evaluation."""
    return {str(file): file.read_bytes() for file in Path("before").rglob("*") if file.is_file()}


@QUICK_WORKERS
@pytest.mark.slow
def test_folder_of_another_program_is_refused_unless_fresh(tiny: CommandLine) -> None:
    work = ("eval", "tiny.yaml", "--out", "before", "--agent")
    deliver, other = (f"programs.py:{name}" for name in ("Deliver", "GiveUp"))
    assert tiny(*work, deliver).status == 0
    before = written()
    ran = tiny(*work, other)
    assert (ran.status, ran.out) == (2, "")
    assert ran.err == (
        f"error: --out before: holds results of another program, {deliver}; "
        "give another folder, or --fresh to replace its report\n"
    )
    assert written() == before
    assert tiny(*work, "programs.py:None_", "--fresh").status == 2  # no such class: it has a plan, and no result
    assert tiny(*work, other, "--fresh").status == 1
    assert "1 of them has a result already" in tiny(*work, other).out
    assert f"another program, {other};" in tiny(*work, deliver).err


@QUICK_WORKERS
@pytest.mark.slow
def test_changed_or_mistyped_program_goes_on_in_its_folder(tiny: CommandLine) -> None:
    work = ("eval", "tiny.yaml", "--out", "before", "--agent")
    assert tiny(*work, "programs.py:Delivers").status == 2
    assert tiny(*work, "programs.py:Deliver").status == 0
    Path("programs.py").write_text(f"{PROGRAMS}\n# changed\n")
    for agent in ("programs.py:Deliver", f"{Path.cwd()}/programs.py:Deliver"):
        ran = tiny(*work, agent)
        assert (ran.status, "have a result already" in ran.out) == (0, False)
