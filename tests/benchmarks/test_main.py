"""`python -m benchmarks`: table, JSON, page, and refusals."""

import json
from pathlib import Path

import pytest

from benchmarks import __main__ as command
from benchmarks import benchmarks
from benchmarks.benchmarks import BenchmarkSkippedError
from benchmarks.checkout import OURS
from cellwright.util.errors import UsageError
from tests.benchmarks.fakes import BROKEN, CURVE, FREE, HELD, FakeBenchmark
from tests.cli.conftest import CommandLine


@pytest.fixture(autouse=True)
def fakes(monkeypatch: pytest.MonkeyPatch) -> None:
    found = (
        FakeBenchmark("held", "What is held", 1.0, (HELD, FREE)),
        FakeBenchmark("broken", "What is broken", 1.0, (BROKEN,)),
        FakeBenchmark("skipped", "What is skipped", 1.0, error=BenchmarkSkippedError("there is no [engine]")),
        FakeBenchmark("failed", "What failed", 1.0, (FREE,), UsageError("it broke")),
        FakeBenchmark("curved", "What is curved", 1.0, (CURVE,)),
        FakeBenchmark("two", "What compares two", 1.0, (HELD,), compared=(FREE,)),
    )
    monkeypatch.setattr(benchmarks, "BENCHMARKS", found)


def test_command_prints_table_of_figures(bench: CommandLine) -> None:
    ran = bench("held", "skipped")
    assert (ran.status, ran.err) == (0, "")
    table = ran.out.partition("What is held: measuring well\n")[2]
    assert [line.split() for line in table.splitlines() if line.strip() and "─" not in line] == [
        ["What", "is", "held"],
        ["figure", "value", "bound"],
        ["one", "thing", "/", "another", "1.05", "x", "≤", "1.15", "held"],
        ["a", "[note]", "with", "a", "|", "in", "it"],
        ["steps", "123457", "/s"],
        ["What", "is", "skipped:", "measuring", "well"],
        ["What", "is", "skipped"],
        ["skipped:", "there", "is", "no", "[engine]"],
    ]
    assert max(map(len, ran.out.splitlines())) <= 120


@pytest.mark.parametrize("name", ["broken", "failed"])
def test_broken_bound_or_failure_gives_exit_status_1(name: str, bench: CommandLine) -> None:
    ran = bench("held", name)
    assert ran.status == 1
    assert ("NOT HELD" if name == "broken" else "failed: it broke") in ran.out


def test_quick_run_prints_no_verdicts(bench: CommandLine) -> None:
    ran = bench("broken", "--quick")
    assert ran.status == 0
    assert "measuring quickly" in ran.out
    assert "HELD" not in ran.out


def test_failure_in_quick_run_gives_exit_status_1(bench: CommandLine) -> None:
    ran = bench("failed", "--quick", "--json")
    assert ran.status == json.loads(ran.out)["exit_status"] == 1


def test_json_lists_all_benchmarks_and_machine(bench: CommandLine) -> None:
    ran = bench("--json")
    document = json.loads(ran.out)
    assert ran.status == document["exit_status"] == 1
    assert [each["name"] for each in document["benchmarks"]] == ["held", "broken", "skipped", "failed", "curved", "two"]
    assert document["benchmarks"][2]["skipped"] == "there is no [engine]"
    assert "mujoco" in document["machine"]["versions"]
    assert "measuring well" in ran.err


def test_benchmark_named_twice_is_measured_once(bench: CommandLine) -> None:
    ran = bench("held", "held", "--json")
    assert len(json.loads(ran.out)["benchmarks"]) == 1


def test_write_option_writes_page(bench: CommandLine, tmp_path: Path) -> None:
    ran = bench("held", "--write", "page.md")
    assert ran.status == 0
    assert "page  page.md" in ran.out
    page = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert "| one thing / another | 1.05 x | ≤ 1.15 | held |" in page


def test_against_option_adds_figures_of_comparison(bench: CommandLine) -> None:
    ran = bench("two", "held", "--against", str(OURS), "--json")
    assert ran.status == 0
    assert [len(each["figures"]) for each in json.loads(ran.out)["benchmarks"]] == [2, 2]
    assert f"comparing with {OURS.name}" in ran.err


def test_curves_are_drawn_beside_page(bench: CommandLine, tmp_path: Path) -> None:
    assert bench("curved", "--write", "page.md").status == 0
    page = (tmp_path / "page.md").read_text(encoding="utf-8")
    assert "![What is curved: step](images/benchmark-curved.svg)" in page
    picture = (tmp_path / "images" / "benchmark-curved.svg").read_text(encoding="utf-8")
    assert all(text in picture for text in ("step", "parts", "us/step", "0.200 us/step a part"))


def test_unwritable_page_is_reported_after_figures(
    bench: CommandLine, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_arguments: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(command, "write_atomic", refuse)
    ran = bench("held", "--write", "page.md")
    assert ran.status == 1
    assert "1.05 x" in ran.out
    assert ran.err == "error: --write page.md: cannot be written: No space left on device\n"


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("heald",), "unknown benchmark 'heald'; did you mean held"),
        (
            ("held", "--against", "."),
            "--against: none of these benchmarks compares two checkouts; name one that does: two",
        ),
        (("two", "--against", "nowhere"), "--against nowhere: src/cellwright/__init__.py is missing; give the folder"),
        (("held", "--write", "page.txt"), "--write page.txt: give a file whose name ends in .md"),
        (("held", "--write", "nowhere/page.md"), "--write nowhere/page.md: there is no folder nowhere"),
    ],
)
def test_bad_arguments_are_refused_in_one_line(arguments: tuple[str, ...], reason: str, bench: CommandLine) -> None:
    ran = bench(*arguments)
    assert (ran.status, ran.out) == (2, "")
    assert ran.err.startswith(f"error: {reason}")
    assert ran.err.count("\n") == 1
