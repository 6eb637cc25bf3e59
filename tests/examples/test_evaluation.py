"""The templates of evaluations on many machines: their shell runs here, with stand-ins for the programs it calls."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import typer
import yaml

from cellwright.cli.main import app
from cellwright.running.evaluation.plan.shard import Shard

FOLDER = Path(__file__).parents[2] / "examples" / "evaluation"
STAND_IN = """#!/bin/sh
echo "$(basename "$0") $*" >> calls
calls=$(wc -l < calls)
for status in $STATUSES; do
    calls=$((calls - 1))
    [ "$calls" -gt 0 ] || exit "$status"
done
"""
"""A program that notes its arguments, and ends with the next of some exit statuses; then with 0."""

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="runs a shell")


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    """Return a folder with the stand-ins, in the working folder of the scripts, where there are two shards."""
    (tmp_path / "bin").mkdir()
    for name in ("cellwright", "scontrol"):
        (tmp_path / "bin" / name).write_text(STAND_IN)
        (tmp_path / "bin" / name).chmod(0o755)
    for number in (1, 2):
        (tmp_path / "shards" / str(number)).mkdir(parents=True)
    return tmp_path


def run(command: list[str], folder: Path, statuses: str = "", **variables: str) -> tuple[int, list[list[str]]]:
    """Return the exit status of a script, and its calls of programs."""
    path = f"{folder / 'bin'}{os.pathsep}{os.environ['PATH']}"
    ran = subprocess.run(command, cwd=folder, env={"PATH": path, "STATUSES": statuses, **variables}, check=False)
    calls = folder / "calls"
    return ran.returncode, [line.split() for line in calls.read_text().splitlines()] if calls.exists() else []


def options_of(call: list[str]) -> dict[str, Any]:
    """Return the options of a call, as the command line reads them; it refuses those that it does not know."""
    assert call[:2] == ["cellwright", "eval"]
    commands = typer.main.get_command(app)
    with commands.make_context("cellwright", call[1:]) as above:
        name, command, rest = commands.resolve_command(above, call[1:])  # type: ignore[attr-defined]
        with command.make_context(name, rest, parent=above) as context:
            return dict(context.params)


def shards_of(text: str, count: int, variables: list[Mapping[str, str]]) -> bool:
    """Return whether tasks with these variables do each shard once."""
    return [Shard.read(text, each) for each in variables] == [Shard(k, count) for k in range(1, count + 1)]


@pytest.mark.parametrize(
    ("statuses", "restarts", "status", "is_queued"),
    [
        ("0", None, 0, False),
        ("1", None, 1, False),
        ("75", None, 75, True),
        ("75", "2", 75, True),
        ("75", "3", 75, False),
    ],
)
def test_slurm_task_does_its_shard_and_is_queued_again_after_75(
    programs: Path, statuses: str, restarts: str | None, status: int, is_queued: bool
) -> None:
    variables = {"SLURM_ARRAY_JOB_ID": "42", "SLURM_ARRAY_TASK_ID": "3", "SLURM_CPUS_PER_TASK": "8"}
    if restarts is not None:
        variables["SLURM_RESTART_COUNT"] = restarts
    script = FOLDER / "slurm.sh"
    returned, (first, *others) = run(["bash", str(script)], programs, statuses, **variables)
    assert returned == status
    assert others == ([["scontrol", "requeue", "42_3"]] if is_queued else [])
    options = options_of(first)
    assert (options["jobs"], options["out"], options["seeds"]) == (8, Path("shards/3"), "1000")
    last = int(re.findall(r"^#SBATCH --array=1-(\d+)$", script.read_text(), re.MULTILINE)[0])
    assert shards_of(options["shard"], last, [{"SLURM_ARRAY_TASK_ID": str(each)} for each in range(1, last + 1)])


def test_slurm_options_come_before_first_command() -> None:
    lines = (FOLDER / "slurm.sh").read_text().splitlines()
    first = next(number for number, line in enumerate(lines) if line and not line.startswith("#"))
    assert [number for number, line in enumerate(lines) if line.startswith("#SBATCH") and number > first] == []
    merge = next(line for line in lines if "--wrap" in line)
    assert options_of(re.findall("'(.*)'", merge)[0].split())["min_score"] == "75%"


def container_of(file: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return the specification of a Job, and its container."""
    job = yaml.safe_load((FOLDER / file).read_text())
    assert (job["apiVersion"], job["kind"]) == ("batch/v1", "Job")
    pod = job["spec"]["template"]["spec"]
    assert pod["restartPolicy"] == "Never"  # a podFailurePolicy requires it
    (container,) = pod["containers"]
    assert [each["name"] for each in container["volumeMounts"]] == [each["name"] for each in pod["volumes"]]
    return job["spec"], container


def test_kubernetes_pod_does_its_shard(programs: Path) -> None:
    spec, container = container_of("kubernetes.yaml")
    command = [*container["command"], *container["args"]]
    status, calls = run(command, programs, "75", JOB_COMPLETION_INDEX="2")
    assert status == 75
    options = options_of(calls[0])
    assert options["out"] == Path("/results/shards/2")
    assert spec["completionMode"] == "Indexed"
    count = spec["completions"]
    assert shards_of(options["shard"], count, [{"JOB_COMPLETION_INDEX": str(each)} for each in range(count)])
    ignored, failing = spec["podFailurePolicy"]["rules"]
    assert (ignored["action"], failing["action"]) == ("Ignore", "FailIndex")
    assert failing["onExitCodes"] == {"containerName": container["name"], "operator": "In", "values": [1, 2]}
    assert spec["backoffLimitPerIndex"] > 0  # for 75


def test_kubernetes_merge_takes_the_folders_of_the_shards(programs: Path) -> None:
    _, container = container_of("kubernetes-merge.yaml")
    command = [*container["command"], *(each.replace("/results/", "") for each in container["args"])]
    _, (call,) = run(command, programs)
    options = options_of(call)
    assert options["folders"] == [Path("shards/1"), Path("shards/2")]
    assert options["out"] == Path("evaluation")


def scripts_of(job: Mapping[str, Any]) -> str:
    """Return the last script of a job of GitHub."""
    return [str(step["run"]) for step in job["steps"] if "run" in step][-1]


@pytest.mark.parametrize(
    ("statuses", "status", "calls"), [("0", 0, 1), ("1", 1, 1), ("75 0", 0, 2), ("75 1", 1, 2), ("75 75", 75, 2)]
)
def test_github_job_does_its_shard_and_repeats_it_after_75(
    programs: Path, statuses: str, status: int, calls: int
) -> None:
    job = yaml.safe_load((FOLDER / "github.yaml").read_text())["jobs"]["shards"]
    shards = job["strategy"]["matrix"]["shard"]
    for shard in shards:
        (programs / "calls").unlink(missing_ok=True)
        script = scripts_of(job).replace("${{ matrix.shard }}", str(shard))
        returned, made = run(["bash", "-e", "-c", script], programs, statuses)
        assert (returned, len(made)) == (status, calls)
        options = [options_of(call) for call in made]
        assert {Shard.read(each["shard"]) for each in options} == {Shard(shard, len(shards))}


def test_github_merge_takes_what_the_shards_upload(programs: Path) -> None:
    jobs = yaml.safe_load((FOLDER / "github.yaml").read_text())["jobs"]
    _, (call,) = run(["bash", "-e", "-c", scripts_of(jobs["merge"])], programs)
    assert options_of(call)["folders"] == [Path("shards/1"), Path("shards/2")]
    assert jobs["merge"]["needs"] == "shards"
    assert jobs["merge"]["if"] == "always()"  # also after a shard that failed
    steps = [step for job in jobs.values() for step in job["steps"]]
    (uploaded, _) = (step["with"] for step in steps if "upload-artifact" in step.get("uses", ""))
    (downloaded,) = (step["with"] for step in steps if "download-artifact" in step.get("uses", ""))
    assert uploaded["path"] == "shard/"
    assert re.fullmatch(downloaded["pattern"].replace("*", ".+"), uploaded["name"])
    assert downloaded["path"] == "shards"


PAGE = Path(__file__).parents[2] / "docs" / "evaluate.md"


def github_workflows() -> list[dict[str, Any]]:
    """Return the workflows of the example and of the page."""
    (block,) = (each for each in re.findall(r"```yaml\n(.*?)```", PAGE.read_text(), re.DOTALL) if "runs-on" in each)
    return [yaml.safe_load(text) for text in ((FOLDER / "github.yaml").read_text(), block)]


def test_github_jobs_install_what_one_variable_names_and_need_no_copy() -> None:
    for workflow in github_workflows():
        assert workflow["env"] == {"CELLWRIGHT": "${{ vars.CELLWRIGHT }}"}
        for job in workflow["jobs"].values():
            (install,) = (step["run"] for step in job["steps"] if "pip install" in step.get("run", ""))
            script = f'pip() {{ printf "%s\\n" "$@"; }}; {install}'
            wheel = "https://host/a b/cellwright-1.0-py3-none-any.whl"
            for value in ("cellwright==1.0", wheel):
                done = subprocess.run(
                    ["bash", "-ec", script], env={"CELLWRIGHT": value}, capture_output=True, text=True
                )
                assert (done.returncode, done.stdout.splitlines()) == (0, ["install", value])
            unset = subprocess.run(["bash", "-ec", script], env={"CELLWRIGHT": ""}, capture_output=True, text=True)
            assert unset.returncode != 0
            assert "set this variable of the repository" in unset.stderr


def test_github_jobs_keep_recordings_of_failures() -> None:
    for workflow in github_workflows():
        scripts = [str(step.get("run")) for job in workflow["jobs"].values() for step in job["steps"]]
        assert all("--record-failed" in each for each in scripts if "cellwright eval lesson" in each)
        uploads = [
            step for job in workflow["jobs"].values() for step in job["steps"] if "upload" in step.get("uses", "")
        ]
        assert all(step["if"] == "always()" for step in uploads)
