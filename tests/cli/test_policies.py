"""Options of a policy: what they say, and which do not go together."""

import pytest

from cellwright.cli.policies import PolicyArguments
from cellwright.util.errors import UsageError


def test_without_a_policy_an_agent_works() -> None:
    assert PolicyArguments().spec("kitter") is None


def test_policy_has_its_words() -> None:
    found = PolicyArguments("ws://h:1", "map.yaml", ["120ms"], chunk=8).spec("policy")
    assert found is not None
    assert found.words == "policy --policy ws://h:1 --policy-map map.yaml --latency 120ms --chunk 8"


def test_each_latency_is_a_policy_of_its_own() -> None:
    found = PolicyArguments("hold", latency=["0ms", "60ms"]).specs("kitter")
    assert [each.latency for each in found] == ["0ms", "60ms"]


@pytest.mark.parametrize(
    ("given", "agent", "error"),
    [
        (PolicyArguments(), "policy", "--agent policy requires --policy"),
        (PolicyArguments(latency=["5ms"]), "kitter", "--latency requires --policy"),
        (PolicyArguments(policy_map="m.yaml"), "kitter", "--policy-map requires --policy"),
        (PolicyArguments(think_first=True), "kitter", "--think-first requires --policy"),
        (PolicyArguments("hold"), "lesson", "--agent lesson and --policy: give one of them"),
        (PolicyArguments("hold", latency=["5ms", "5ms"]), "policy", "--latency 5ms is given twice"),
        (PolicyArguments("hold", latency=["5ms", "6ms"]), "policy", "--latency: one for a run"),
        (PolicyArguments("hold", chunk=0), "policy", "--chunk 0: must be from 1 to 10000"),
    ],
)
def test_options_that_do_not_go_together_are_refused(given: PolicyArguments, agent: str, error: str) -> None:
    with pytest.raises(UsageError, match=error):
        given.spec(agent)
