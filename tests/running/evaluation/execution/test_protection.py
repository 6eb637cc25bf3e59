"""Programs that cheat: what `over` and `verify` do about it, and what a plain evaluation believes."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

from cellwright.running.evaluation.execution.local import LocalRunner
from cellwright.running.evaluation.execution.runner import RunnerOptions
from cellwright.running.evaluation.plan.job import EvaluatedTrial, Job, make_jobs
from cellwright.running.evaluation.results.result import Result
from cellwright.running.evaluation.results.results_file import ResultsFile, read_results
from tests.running.evaluation.cheats import CHEATS, SPOILED
from tests.support.quick_children import QUICK_WORKERS

pytestmark = pytest.mark.slow

SOCKET, VERIFY = {"over": "socket"}, {"verify": True}
Evaluate = Callable[..., list[Result]]


def jobs_of(folder: Path, program: str, seeds: int = 1, **protection: object) -> list[Job]:
    trial = EvaluatedTrial("spoiled", (folder / "spoiled.yaml",), 6.0, 6.0, 500.0)
    return make_jobs([trial], f"cheats.py:{program}", range(1, seeds + 1), vary=False, **protection)  # type: ignore[arg-type]


@pytest.fixture
def evaluate(folder: Path) -> Evaluate:
    """Return a function that evaluates a program under a protection."""
    (folder / "spoiled.yaml").write_text(SPOILED)
    (folder / "cheats.py").write_text(CHEATS)

    def run(program: str, seeds: int = 1, *, records: bool = False, **protection: object) -> list[Result]:
        with ResultsFile(folder / "out") as store:
            evaluation = LocalRunner(store, RunnerOptions(records=records))
            assert evaluation.run(jobs_of(folder, program, seeds, **protection)), (
                evaluation.failure,
                evaluation.faults,
            )
            store.restore()
            return list(store.results.values())

    return run


@QUICK_WORKERS
def test_honest_program_has_the_same_result_under_any_protection(evaluate: Evaluate) -> None:
    results = [
        each for protection in ({}, SOCKET, VERIFY, SOCKET | VERIFY) for each in evaluate("Deliver", **protection)[-1:]
    ]
    assert [(each.over, each.verified) for each in results] == [
        ("", False),
        ("socket", False),
        ("", True),
        ("socket", True),
    ]
    assert {(each.outcome, each.points) for each in results} == {("done", 4.0)}
    assert len({each.state_hash for each in results}) == 1
    assert len({str(each.score) for each in results}) == 1
    assert len({str(each.timeline) for each in results}) == 1
    assert len({each.key for each in results}) == 4
    assert not list(Path("out", "recordings").iterdir())
    assert not list(Path("out", "logs").glob("*.verification"))


@QUICK_WORKERS
@pytest.mark.parametrize("program", ["PatchesScorer", "Teleports"])
def test_cheat_in_the_process_of_the_referee_is_believed_without_protection(program: str, evaluate: Evaluate) -> None:
    """A plain evaluation says that it trusts the program; this is what for."""
    (result,) = evaluate(program)
    assert (result.outcome, result.points, result.over, result.verified) == ("done", 6.0, "", False)


@QUICK_WORKERS
@pytest.mark.parametrize(
    ("program", "outcome", "points"), [("PatchesScorer", "done", 4.0), ("Teleports", "crashed", 0.0)]
)
def test_cheat_over_a_socket_has_its_honest_points(
    program: str, outcome: str, points: float, evaluate: Evaluate
) -> None:
    (result,) = evaluate(program, **SOCKET)
    assert (result.outcome, result.points) == (outcome, points)


@QUICK_WORKERS
@pytest.mark.parametrize("program", ["PatchesScorer", "Teleports"])
def test_cheat_is_found_by_verification(program: str, evaluate: Evaluate) -> None:
    (result,) = evaluate(program, **VERIFY)
    assert (result.outcome, result.points, result.verified) == ("not_reproduced", 0.0, False)
    assert result.reason == "its commands alone earn 4 points, but 6 were reported"
    assert result.is_lost
    assert len(list(Path("out", "recordings").iterdir())) == 1  # evidence


@QUICK_WORKERS
@pytest.mark.parametrize("protection", [SOCKET, VERIFY], ids=["socket", "verify"])
def test_results_that_a_program_edits_are_written_again(protection: dict[str, object], evaluate: Evaluate) -> None:
    results = evaluate("EditsResults", 2, **protection)
    assert [each.points for each in results] == [4.0, 4.0]
    assert [each.points for each in read_results(Path("out")).values()] == [4.0, 4.0]


FORGED = '''
from pathlib import Path
from programs import Deliver

class ForgesRecording(Deliver):
    """Leaves a recording without its commands."""

    def run(self, client):
        super().run(client)
        for file in Path("out/recordings").iterdir():
            file.unlink()
            file.write_bytes(b"no recording")
'''


@QUICK_WORKERS
def test_run_whose_recording_is_gone_is_not_believed(evaluate: Evaluate, folder: Path) -> None:
    (folder / "cheats.py").write_text(FORGED)
    (result,) = evaluate("ForgesRecording", **VERIFY)
    assert (result.outcome, result.points) == ("not_reproduced", 0.0)
    assert result.reason.startswith("its commands could not be played: ")


@QUICK_WORKERS
@pytest.mark.parametrize(("program", "outcome"), [("GiveUp", "gave_up"), ("Crash", "crashed"), ("Quit", "died")])
def test_run_that_is_not_done_keeps_its_outcome_when_verified(program: str, outcome: str, evaluate: Evaluate) -> None:
    Path("cheats.py").write_text(f"from programs import {program}")
    (result,) = evaluate(program, **VERIFY)
    assert result.outcome == outcome
    assert result.verified == (outcome != "died")
    assert not list(Path("out", "recordings").iterdir())


@QUICK_WORKERS
@pytest.mark.skipif(sys.platform != "linux", reason="memory is limited there only")
def test_program_over_a_socket_has_the_limits_of_a_run(evaluate: Evaluate) -> None:
    Path("cheats.py").write_text("from programs import Eat")
    (result,) = evaluate("Eat", **SOCKET)
    assert (result.outcome, result.points) == ("memory_limit", 0.0)


@QUICK_WORKERS
def test_recording_of_verified_run_stays_on_request(evaluate: Evaluate) -> None:
    evaluate("Deliver", records=True, **VERIFY)
    assert [each.suffix for each in Path("out", "recordings").iterdir()] == [".mcap"]
