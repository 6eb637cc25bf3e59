"""A policy in a session of a robot: its outcomes, and its errors."""

from collections.abc import Callable

import pytest

from cellwright import Session
from cellwright.clients.policies.agent import PolicyAgent
from cellwright.clients.policies.policy import PolicyConnectionError
from cellwright.running.run.robot_policy import INFRASTRUCTURE, RobotPolicy
from cellwright.util.errors import UsageError
from tests.clients.operators.nodes import robot
from tests.clients.policies.test_agent import Scripted, spec
from tests.clients.policies.test_robot_workplace import going


def fail(_observation: object, _number: int) -> list[list[float]]:
    raise PolicyConnectionError("ws://x: the connection is lost")


def worked(infer: Callable[..., object]) -> RobotPolicy:
    return RobotPolicy(PolicyAgent(spec(latency="70ms"), lambda _setting: Scripted(infer)))  # type: ignore[arg-type]


def test_policy_works_a_robot_until_its_time_is_over() -> None:
    program = worked(going(0, 0.5))
    with Session(robot()) as session:
        result = session.run(program, until=0.5)
        assert (result.outcome, result.error, result.simulated) == ("until", "", 0.5)
        assert session.node.commander.taken > 5
    assert program.agent.summary.endswith("requests, 100 ms from observation to action")


def test_lost_policy_is_infrastructure() -> None:
    result = Session(robot()).run(worked(fail), until=0.5)
    assert (result.outcome, result.error) == (INFRASTRUCTURE, "ws://x: the connection is lost")


def test_stop_ends_a_policy() -> None:
    with Session(robot()) as session:

        def infer(observation: object, number: int) -> object:
            if number == 2:
                session.stop.request()
            return going(0, 0.5)(observation, number)

        assert session.run(worked(infer)).outcome == "stopped"


def test_agent_of_a_cell_is_refused_at_a_robot() -> None:
    with pytest.raises(UsageError, match="an agent needs a cell"):
        Session(robot()).run("kitter", until=0.1)
