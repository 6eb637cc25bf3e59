"""Card of the benchmark: its tables are those of the files, and its blocks are complete."""

import re

import pytest

from cellwright.config.trial.task import Discarded
from cellwright.util.errors import UsageError
from kitting.baselines import BASELINES
from kitting.benchmark import ROOT, TASKS, Split, seeds
from kitting.card import CARD, filled, generated, in_words, tables
from kitting.croissant import RESULTS
from kitting.scores import read_outcomes

TEXT = CARD.read_text(encoding="utf-8")
BLOCKS = ("Tasks", "Robot", "Observations", "Protocol", "Demonstrations", "Baselines", "Repeat it", "Submit", "Limits")


def test_generated_files_are_as_they_would_be_made_now() -> None:
    for name, text in generated():
        assert (ROOT / name).read_text(encoding="utf-8") == text, f"{name}: run python -m kitting card"


def test_card_has_all_blocks_and_each_table_once() -> None:
    assert re.findall(r"^## (.+)$", TEXT, re.MULTILINE) == list(BLOCKS)
    assert sorted(re.findall(r"<!-- made: (\w+) -->", TEXT)) == sorted(tables())


def test_unknown_table_is_refused() -> None:
    with pytest.raises(KeyError, match="weather"):
        filled("<!-- made: weather -->\n<!-- end -->\n")


def test_condition_without_words_is_refused() -> None:
    with pytest.raises(UsageError, match="there are no words for the condition Discarded; add them to in_words"):
        in_words(Discarded("agv1"))


def test_results_are_of_all_baselines_on_all_seeds_of_the_test() -> None:
    found = read_outcomes(RESULTS)
    assert list(found) == list(BASELINES)
    plan = [(task.name, seed) for task in TASKS for seed in seeds(Split.TEST)]
    for records in found.values():
        assert [(each.task, each.seed) for each in records] == plan


def test_replay_comes_to_the_states_of_the_bundled_agent_and_nothing_succeeds_by_standing_still() -> None:
    found = read_outcomes(RESULTS)
    states = {(each.task, each.seed): each.state_hash for each in found["kitter"]}
    assert all(states[each.task, each.seed] == each.state_hash for each in found["replay"])
    assert not any(each.success for each in found["hold"])


def test_link_of_card_leads_to_a_file() -> None:
    targets = [target for target in re.findall(r"\]\(([^)#]+)\)", TEXT) if "://" not in target]
    assert targets
    assert [target for target in targets if not (CARD.parent / target).exists()] == []
