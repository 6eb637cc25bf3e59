"""Tests of jobs and their keys."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright import load_trial
from cellwright.config.models.model import Furniture, ModelShape, UserModel
from cellwright.config.parsing.overrides import Override
from cellwright.config.trial.trial import Trial
from cellwright.running.evaluation.plan import job as job_module
from cellwright.running.evaluation.plan.job import (
    EvaluatedTrial,
    Job,
    agent_digest,
    log_name,
    make_jobs,
    models_digest,
    repeated,
)


def keys(folder: Path, agent: str = "robot.py:Robot", seeds: int = 1, *, vary: bool = False) -> list[str]:
    trial = EvaluatedTrial("one", (folder / "one.yaml",), 3.0, 3.0, 500.0)
    return [each.key for each in make_jobs([trial], agent, range(seeds), vary=vary)]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "one.yaml").write_text("{}")
    (tmp_path / "robot.py").write_text("class Robot: ...")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_jobs_cover_each_trial_and_seed(folder: Path) -> None:
    (folder / "other.yaml").write_text("a: 1")
    trials = [EvaluatedTrial(name, (folder / f"{name}.yaml",), 3.0, 3.0, 500.0) for name in ("one", "other", "one")]
    jobs = make_jobs(trials, "lesson", [1, 2], vary=True)
    assert [each.name for each in jobs] == ["one seed 1", "one seed 2", "other seed 1", "other seed 2"]
    assert len({each.key for each in jobs}) == 4
    assert len({each.log_name for each in jobs}) == 4
    assert all(each.vary for each in jobs)


def test_key_changes_with_options_agent_seeds_and_versions(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    first = keys(folder)
    assert keys(folder) == first
    assert keys(folder, vary=True) != first
    assert keys(folder, "robot.py:Other") != first
    assert keys(folder, seeds=2)[1] != first[0]
    monkeypatch.setattr(job_module, "versions", lambda: {"cellwright": "9"})
    assert keys(folder) != first


def overridden(folder: Path, *overrides: str) -> Job:
    read = tuple(map(Override.read, overrides))
    trial = EvaluatedTrial("one", (folder / "one.yaml",), 3.0, 3.0, 500.0, given=("one.yaml",), overrides=read)
    (job,) = make_jobs([trial], "robot.py:Robot", [1], vary=True)
    return job


def test_overrides_are_part_of_key_and_command(folder: Path) -> None:
    texts = [(), ("time_limit=60",), ("time_limit=60.0",), ("time_limit=60", "cellwright.seed=1")]
    jobs = [overridden(folder, *each) for each in texts]
    assert len({job.key for job in jobs}) == 4
    assert overridden(folder, "time_limit=60").key == jobs[1].key
    assert jobs[0].key == make_jobs([jobs[0].trial], "robot.py:Robot", [1], vary=True)[0].key
    assert overridden(folder, "faulty_parts=[a b]").command == (
        "cellwright run one.yaml --agent robot.py:Robot --seed 1 --vary --set 'faulty_parts=[a b]'"
    )


def test_repeated_job_has_key_of_its_own(folder: Path) -> None:
    trial = EvaluatedTrial("one", (folder / "one.yaml",), 3.0, 3.0, 500.0)
    first, second = make_jobs([trial], "robot.py:Robot", [1, 2], vary=False)
    again = repeated(first)
    assert len({first.key, second.key, again.key, repeated(second).key}) == 4
    assert (again.name, again.command, repeated(first)) == (first.name, first.command, again)
    assert again.log_name != first.log_name


@pytest.mark.slow
@pytest.mark.parametrize("agent", ["robot.py:Robot", "robot:Robot"])
@pytest.mark.parametrize("file", ["one.yaml", "robot.py", "beside.py"])
def test_key_changes_with_files_of_trial_and_agent(folder: Path, file: str, agent: str) -> None:
    (folder / "robot.py").write_text("import beside\nclass Robot: ...")
    (folder / "beside.py").write_text("")
    first = keys(folder, agent)
    (folder / file).write_text("# changed")
    assert keys(folder, agent) != first


@pytest.mark.parametrize("agent", ["robot.py:Robot", "robot:Robot"])
def test_key_stays_when_a_file_changes_that_the_agent_does_not_import(folder: Path, agent: str) -> None:
    first = keys(folder, agent)
    (folder / "other_robot.py").write_text("# a program of another team")
    assert keys(folder, agent) == first


@pytest.fixture
def team(folder: Path) -> Path:
    """Return the folder of a package: `robot` imports `skills.pick`, and nothing imports `idle`."""
    package = folder / "team"
    (package / "skills").mkdir(parents=True)
    (package / "__init__.py").write_text("raise RuntimeError('read, not run')")
    (package / "robot.py").write_text("from .skills import pick\nclass Robot: ...")
    (package / "skills" / "pick.py").write_text("")
    (package / "idle.py").write_text("")
    return package


def test_digest_of_agent_in_package_covers_what_it_imports(team: Path) -> None:
    for file, counts in (("skills/pick.py", True), ("__init__.py", True), ("robot.py", True), ("idle.py", False)):
        first = agent_digest("team.robot:Robot")
        with (team / file).open("a") as text:
            text.write("\n# better")
        assert (agent_digest("team.robot:Robot") != first) == counts, file


def test_digest_of_installed_package_covers_what_it_imports(team: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    elsewhere = team.parent / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.syspath_prepend(str(team.parent))
    monkeypatch.chdir(elsewhere)
    (team.parent / "numpy.py").write_text("")  # of another package, though it is installed beside
    (team / "robot.py").write_text("import numpy\nfrom team.skills import pick")
    first = agent_digest("team.robot:Robot")
    (team / "idle.py").write_text("# changed")
    (team.parent / "numpy.py").write_text("# changed")
    assert agent_digest("team.robot:Robot") == first
    (team / "skills" / "pick.py").write_text("# changed")
    assert agent_digest("team.robot:Robot") != first


@pytest.mark.parametrize("text", ["import importlib; importlib.import_module('id' + 'le')", "import sys; sys.path[0]"])
def test_digest_of_agent_that_computes_its_imports_covers_whole_package(team: Path, text: str) -> None:
    (team / "skills" / "pick.py").write_text(text)
    first = agent_digest("team.robot:Robot")
    (team / "idle.py").write_text("# changed")
    assert agent_digest("team.robot:Robot") != first


def test_bundled_installed_and_unknown_agents_have_digest(folder: Path) -> None:
    digests = {agent_digest(agent) for agent in ("lesson", "json:Decoder", "hashlib:x", "nobody", "no.such:Robot", "")}
    assert len(digests) == 6


def test_digest_of_user_model_covers_its_files(folder: Path) -> None:
    mesh = folder / "cup.stl"
    mesh.write_bytes(b"one")
    model = UserModel((ModelShape("mesh", (1.0, 1.0, 1.0), mesh=mesh),))
    plain, own = Trial("own"), Trial("own", part_models={"cup": model})
    first = models_digest(own)
    assert models_digest(plain) == ""
    assert models_digest(Trial("own", furniture=(Furniture("table", model),))) not in ("", first)
    mesh.write_bytes(b"two")
    assert models_digest(own) != first
    keys = {
        make_jobs([EvaluatedTrial("one", (folder / "one.yaml",), 3.0, 3.0, 500.0, models)], "lesson", [1], vary=False)[
            0
        ].key
        for models in ("", first, models_digest(own))
    }
    assert len(keys) == 3


def test_digest_of_user_model_is_the_same_in_another_folder(tmp_path: Path) -> None:
    digests = set()
    for name in ("here", "there"):
        (tmp_path / name).mkdir()
        mesh, mjcf = tmp_path / name / "cup.stl", tmp_path / name / "table.xml"
        mesh.write_bytes(b"one")
        mjcf.write_bytes(b"two")
        shape = ModelShape("mesh", (1.0, 1.0, 1.0), mesh=mesh)
        table = Furniture("table", UserModel(mjcf=mjcf))
        digests.add(models_digest(Trial("own", part_models={"cup": UserModel((shape,))}, furniture=(table,))))
    assert len(digests) == 1


def test_command_of_job_repeats_run(folder: Path) -> None:
    trial = EvaluatedTrial("one", (folder / "one.yaml",), 3.0, 3.0, 500.0, given=("one two.yaml", "more.yaml"))
    (job,) = make_jobs([trial], "robot.py:Robot", [7], vary=True)
    assert job.command == "cellwright run 'one two.yaml+more.yaml' --agent robot.py:Robot --seed 7 --vary"


def test_digest_ignores_broken_link_and_folder(tmp_path: Path) -> None:
    program = tmp_path / "mine.py"
    program.write_text("__import__('ours')\nclass Mine: ...")  # all files beside it count
    before = agent_digest(f"{program}:Mine")
    (tmp_path / ".#mine.py").symlink_to("nobody@nowhere.1234")  # an editor's lock
    (tmp_path / "folder.py").mkdir()
    assert agent_digest(f"{program}:Mine") == before


def test_log_name_of_long_trial_name_can_be_written(tmp_path: Path) -> None:
    file = tmp_path / "trial.yaml"
    file.write_text("")
    (job,) = make_jobs([EvaluatedTrial("配" * 80, (file,), 0.0, 0.0, 0.0)], "none", [1], vary=False)
    (tmp_path / job.log_name).write_text("")


def test_log_name_is_no_path_whatever_a_file_of_results_says() -> None:
    assert log_name("../up", 1, "../../etc") == "___up-1-______et.log"


def test_digest_depends_on_robot_and_not_on_its_folder(tmp_path: Path) -> None:
    digests = []
    for folder, link in (("here", "base"), ("there", "base"), ("elsewhere", "post")):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "post.urdf").write_text(f'<robot name="post"><link name="{link}"/></robot>')
        cell = tmp_path / folder / "cell.yaml"
        cell.write_text("cell: {robots: {post: {model: post.urdf, at: [0, 0, 0]}}}")
        digests.append(models_digest(load_trial(cell)))
    assert digests[0] == digests[1] != digests[2]


def test_latencies_are_compared_as_variants_of_a_trial_and_run_with_their_seed(folder: Path) -> None:
    trial = EvaluatedTrial("one", (folder / "one.yaml",), 3.0, 3.0, 500.0)
    latencies = ("60ms", "measured")
    jobs = make_jobs([trial], "policy --policy hold", [7], vary=False, latencies=latencies)
    assert [each.name for each in jobs] == ["one latency_ms=60 seed 7", "one latency_ms=measured seed 7"]
    assert [each.overrides for each in jobs] == [{"latency_ms": "60"}, {"latency_ms": "measured"}]
    assert jobs[0].program == "policy --policy hold --latency 60ms --policy-seed 7"
    assert jobs[0].command.endswith("--policy hold --latency 60ms --seed 7")
    assert len({each.key for each in jobs}) == 2


def test_program_and_map_of_a_policy_are_part_of_its_digest(folder: Path) -> None:
    (folder / "map.yaml").write_text("a: 1")
    words = "policy --policy robot.py:Robot --policy-map map.yaml"
    digests = [agent_digest(words)]
    (folder / "map.yaml").write_text("a: 2")
    digests.append(agent_digest(words))
    (folder / "robot.py").write_text("class Robot: pass")
    digests.append(agent_digest(words))
    assert len(set(digests)) == 3


def test_file_of_a_compared_latency_is_part_of_the_key(folder: Path) -> None:
    trial, found = EvaluatedTrial("one", (folder / "one.yaml",), 3.0, 3.0, 500.0), []
    for text in ("7\n", "8\n", "7\n"):
        (folder / "times.txt").write_text(text)
        [job] = make_jobs([trial], "policy --policy hold", [1], vary=False, latencies=["file:times.txt"])
        found.append(job.key)
    assert found[0] == found[2] != found[1]
