"""Baselines: known by name, with the options of programs that exist."""

from pathlib import Path

import pytest

from cellwright.clients.agents.agent import find_agent
from cellwright.clients.policies.program import check_policy
from cellwright.clients.policies.spec import PolicySpec
from cellwright.util.errors import UnknownNameError
from kitting.baselines import BASELINES, find_baseline
from kitting.benchmark import TASKS, Split


def test_unknown_baseline_is_refused_with_the_nearest() -> None:
    with pytest.raises(UnknownNameError, match="clon"):
        find_baseline("clon")


@pytest.mark.parametrize("name", ["kitter", "clone"])
def test_agent_of_baseline_exists(name: str) -> None:
    option, agent = find_baseline(name).words(Path("scores"))
    assert option == "--agent"
    assert callable(find_agent(agent))


@pytest.mark.parametrize("name", ["random", "hold"])
def test_policy_of_baseline_fits_every_task_and_sees_no_picture(name: str) -> None:
    _, policy, _, key_map = find_baseline(name).words(Path("scores"))
    words = PolicySpec.of(policy, map_file=key_map).words
    for task in TASKS:
        check_policy(words, task.trial(Split.TEST))
    assert "camera" not in Path(key_map).read_text(encoding="utf-8").partition("\n")[2]


def test_replay_takes_the_recordings_of_the_bundled_agent(tmp_path: Path) -> None:
    assert BASELINES["replay"].words(tmp_path) == ["--agent", f"replay:{tmp_path.resolve()}/kitter"]
