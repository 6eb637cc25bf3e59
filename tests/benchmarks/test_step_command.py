"""The whole command: a real benchmark, quickly."""

import json

from tests.cli.conftest import CommandLine


def test_step_benchmark_runs_quickly_as_json(bench: CommandLine) -> None:
    ran = bench("step", "--quick", "--json")
    assert ran.status == 0
    (taken,) = json.loads(ran.out)["benchmarks"]
    assert (taken["name"], taken["failed"], taken["skipped"]) == ("step", None, None)
    assert {figure["what"] for figure in taken["figures"]} >= {"0 parts at rest", "60 parts at rest / arm only"}
    assert "A step of the cell: 60 parts" in ran.err
