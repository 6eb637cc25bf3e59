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


def slower(steps: Iterable[Step]) -> Iterator[Step]:
    """Yield the steps with a longer latency in all reports, as its rules make them: nothing was run with it."""
    for step in steps:
        if isinstance(step, Command) and step.name == TOPIC:
            document = json.loads(step.message().data)
            if rules := document.get("rules"):
                rules["latency"] = "110ms"
            if request := document.get("request"):
                ready = request["observed"] + 55
                first = -(-ready // 25) * 25
                index = (first - request["observed"]) // 25
                request |= {"latency": 55, "ready": ready, "first": first, "index": index}
            step = replace(step, data=TYPES.to_cdr(String(json.dumps(document))))
        yield step


def test_latency_that_was_edited_and_not_run_fails_by_its_commands(recorded: Path) -> None:
    with RecordingFile(recorded) as recording, rebuild(recording) as rebuilt:
        verdict = verify(rebuilt, slower(recorded_steps(recording)), result=recording.end)
    assert verdict.answer is Answer.DIFFERENT
    assert verdict.hashes > 0
    assert verdict.different is verdict.moved is None
    assert verdict.policy == "request 0: no action acts at tick 50 (got a command)"
