"""Words of a policy: they say the same both ways, and what does not go together is refused."""

from pathlib import Path

import pytest

from cellwright.clients.agents.agent import AgentError, find_agent
from cellwright.clients.policies.agent import PolicyAgent
from cellwright.clients.policies.schedule import Mode
from cellwright.clients.policies.spec import PolicySpec, is_policy
from cellwright.util.errors import UsageError


@pytest.mark.parametrize(
    "spec",
    [
        PolicySpec.of("ws://127.0.0.1:8000"),
        PolicySpec.of("ws://h:1", map_file="my map.yaml", latency="120ms", mode="sync", chunk=8, thinks_first=True),
        PolicySpec("hold", seed=7),
    ],
)
def test_words_say_the_policy(spec: PolicySpec) -> None:
    assert PolicySpec.read(spec.words) == spec
    assert is_policy(spec.words)


@pytest.mark.parametrize(
    ("latency", "mode", "rule", "source"),
    [
        ("", "", Mode.FROZEN, None),
        ("120ms", "", Mode.ASYNC, "120ms"),
        ("", "async", Mode.ASYNC, "measured"),
        ("", "sync", Mode.SYNC, "measured"),
        ("file:{}", "sync", Mode.SYNC, "file:{}"),
    ],
)
def test_mode_and_latency_imply_each_other(
    latency: str, mode: str, rule: Mode, source: str | None, tmp_path: Path
) -> None:
    file = tmp_path / "times.txt"
    file.write_text("100\n")
    found = PolicySpec.of("hold", latency=latency.format(file), mode=mode)
    assert found.rule is rule
    assert (found.source and found.source.text) == (source and source.format(file))


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("policy", "no policy given; add --policy"),
        ("policy --policy", "no policy given; add --policy"),
        ("policy --policy hold --latncy 5ms", "unknown option --latncy; did you mean --latency"),
        ("policy --policy hold --chunk many", "--chunk must be a whole number (got many)"),
        ("policy --policy hold --chunk 0", "--chunk 0: must be from 1 to 10000"),
        ("policy --policy hold --policy-mode slow", "--policy-mode slow: give async, sync, frozen"),
        ("policy --policy hold --policy-mode frozen --latency 5ms", "leave out --latency"),
        ("policy --policy hold --latency soon", "--latency soon: unknown source"),
        ("policy --policy run.mcap --latency 5ms", "the recording has its own rules"),
        ("policy --policy none.jsonl", "none.jsonl: cannot be read"),
        ("policy 'open", "No closing quotation; put values with blanks into quotes"),
        ("policy --policy holt", "unknown policy 'holt'; did you mean hold"),
        ("policy --policy localhost:8000", "write ws://localhost:8000"),
        ("policy --policy ftp://h:1", "no scheme of a policy server"),
        ("policy --policy nowhere.py:Mine", "nowhere.py"),
    ],
)
def test_words_that_say_no_policy_are_refused(words: str, error: str) -> None:
    with pytest.raises(AgentError) as caught:
        find_agent(words)
    assert error in str(caught.value)


def test_agent_is_found_by_the_words() -> None:
    assert isinstance(find_agent("policy --policy ws://127.0.0.1:1 --latency 60ms")(), PolicyAgent)


def test_error_is_one_of_use() -> None:
    with pytest.raises(UsageError, match="the recording has its own rules"):
        PolicySpec.of("run.jsonl", chunk=3)
