"""Policies in recordings: their reports come back, and a changed one fails the verification by its name."""

import json
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

import pytest

from cellwright.clients.policies.agent import PolicyAgent
from cellwright.clients.policies.report import TOPIC
from cellwright.middleware.messages import TYPES
from cellwright.middleware.messages.standard import String
from cellwright.recording.format.commands import Command
from cellwright.recording.format.reader import RecordingFile
from cellwright.recording.replay.policies import policy_reports
from cellwright.recording.replay.rebuild import rebuild
from cellwright.recording.replay.verify import Answer, Step, recorded_steps, verify
from cellwright.running.run import RunOptions, Session
from tests.clients.policies.test_agent import Scripted, raising, spec


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("policy") / "run.mcap"
    agent = PolicyAgent(spec(latency="60ms", chunk=4), lambda _setting: Scripted(raising))
    with Session("lesson", record=path, options=RunOptions(until=1.0)) as session:
        session.run(agent)
    return path


def changed(steps: Iterable[Step], number: int, name: str) -> Iterator[Step]:
    """Yield the steps with another number in the report of a request."""
    for step in steps:
        if isinstance(step, Command) and step.name == TOPIC:
            document = json.loads(step.message().data)
            if document.get("request", {}).get("number") == number:
                document["request"][name] += 1
                step = replace(step, data=TYPES.to_cdr(String(json.dumps(document))))
        yield step


def test_reports_of_a_recording_are_the_rules_and_the_requests(recorded: Path) -> None:
    with RecordingFile(recorded) as recording:
        kinds = [next(iter(json.loads(text))) for text in policy_reports(recording)]
    assert kinds == ["rules", *["request"] * 5]


@pytest.mark.parametrize("name", ["", "latency", "first", "observed"])
def test_verification_names_the_request_that_was_changed(recorded: Path, name: str) -> None:
    with RecordingFile(recorded) as recording, rebuild(recording) as rebuilt:
        steps = recorded_steps(recording)
        verdict = verify(rebuilt, changed(steps, 2, name) if name else steps, result=recording.end)
    assert verdict.requests >= 3
    assert verdict.answer is (Answer.DIFFERENT if name else Answer.EQUAL)
    assert verdict.policy.startswith(f"request 2: {name} must be" if name else "")
