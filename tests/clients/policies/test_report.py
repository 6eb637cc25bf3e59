"""Reports of an episode: they say the same both ways, hostile ones are refused, and a changed number is found."""

import json
from contextlib import suppress
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.policies.latency import Latency, in_ticks
from cellwright.clients.policies.recorded import RecordedPolicy
from cellwright.clients.policies.report import ReportCheck, RequestReport, Rules, decode_report, encoded_actions
from cellwright.clients.policies.schedule import Mode
from cellwright.util.errors import UsageError

RULES = Rules("ws://h:1", "uniform:60ms..180ms", 3, (1, 500), 20_000_000, 25, Mode.ASYNC, horizon=4)
ACTIONS = np.arange(16.0).reshape(8, 2)


def episode(rules: Rules = RULES, count: int = 5) -> list[Rules | RequestReport]:
    """Return the reports of an episode that follows its rules."""
    schedule, source = rules.schedule(), Latency.read(rules.latency).source(rules.seed)
    found: list[Rules | RequestReport] = [rules]
    instant = 0
    while schedule.requests < count:
        if schedule.is_due(instant):
            latency = in_ticks(source(None), rules.tick)  # type: ignore[arg-type]  # a drawn one
            request = schedule.ask(instant, latency=latency, length=8)
            ready = instant + request.latency
            found.append(
                RequestReport(
                    request.number, instant, latency, ready, request.first, request.index, 8,
                    actions=encoded_actions(ACTIONS),
                )
            )  # fmt: skip
        schedule.choose(instant)
        instant += rules.period
    return found


def checked(reports: list[Rules | RequestReport]) -> str:
    check = ReportCheck()
    for each in reports:
        check.take(each.encode())
    return check.fault


@pytest.mark.parametrize("mode", [Mode.ASYNC, Mode.SYNC])
def test_episode_by_its_rules_has_no_fault(mode: Mode) -> None:
    reports = episode(replace(RULES, mode=mode))
    assert [decode_report(each.encode()) for each in reports] == reports
    assert checked(reports) == ""


@pytest.mark.parametrize("name", ["number", "observed", "latency", "ready", "first", "index"])
def test_changed_number_is_found_and_its_request_named(name: str) -> None:
    reports = episode()
    third = reports[3]
    assert isinstance(third, RequestReport)
    reports[3] = replace(third, **{name: getattr(third, name) + 1})
    assert checked(reports).startswith(f"request {3 if name == 'number' else 2}: {name} must be")


def test_drawn_latency_must_be_the_one_of_the_seed_even_if_all_else_fits() -> None:
    reports = episode(replace(RULES, seed=4))
    reports[0] = RULES
    assert checked(reports).startswith("request 0: latency must be")


def test_request_before_the_rules_is_a_fault() -> None:
    assert checked(episode()[1:]) == "request 0: comes before the rules"


def test_actions_come_back() -> None:
    report = episode()[1]
    assert isinstance(report, RequestReport)
    assert (report.matrix() == ACTIONS).all()


@pytest.mark.parametrize("actions", ["", "x", encoded_actions(ACTIONS)[:-4], encoded_actions(ACTIONS * np.nan)])
def test_actions_that_are_none_are_refused(actions: str) -> None:
    report = episode()[1]
    assert isinstance(report, RequestReport)
    with pytest.raises(UsageError, match="request 0"):
        replace(report, actions=actions).matrix()


VALID = json.loads(episode()[1].encode())["request"]


@pytest.mark.parametrize(
    "document",
    [
        "",
        "{}",
        "[]",
        '{"rules": {}}',
        '{"other": {}}',
        '{"rules": {}, "request": {}}',
        json.dumps({"request": {**VALID, "observed": -1}}),
        json.dumps({"request": {**VALID, "observed": 10**12}}),
        json.dumps({"request": {**VALID, "length": 0}}),
        json.dumps({"request": {**VALID, "latency": "5"}}),
        "[" * 100_000,
    ],
)
def test_text_that_is_no_report_is_refused(document: str) -> None:
    with pytest.raises(UsageError, match="no report of a policy"):
        decode_report(document)


@given(st.text(max_size=200))
def test_no_text_breaks_the_reader(text: str) -> None:
    with suppress(UsageError):
        decode_report(text)


def test_recorded_policy_needs_the_rules_and_a_request() -> None:
    for reports in (episode()[1:], episode()[:1], [*episode(), RULES], []):
        with pytest.raises(UsageError, match=r"run\.mcap: holds no episode"):
            RecordedPolicy.of([each.encode() for each in reports], "run.mcap")
