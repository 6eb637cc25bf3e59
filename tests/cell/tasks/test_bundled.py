"""Bundled tasks: programs succeed in them, with their seeds, and their state hashes are kept."""

from contextlib import closing

import pytest

from cellwright import Client, Session
from cellwright.clients.agents.agent import Agent, find_agent
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.trial.catalogue import find_trial
from cellwright.config.trial.gear2017 import load_trial
from cellwright.motion import Joints, along, move, solve, straight, tool_down
from cellwright.running.run import Outcome, RunResult, cell_result
from tests.cell.tasks.humanoid_agents import Giver, Reacher

SEED = 2


class Placer:
    """Lays down what the cup holds at an ordered place of the tray."""

    def run(self, client: Client) -> None:
        """Place the part, and wait."""
        client.joint_states.wait(1.0)
        client.wait_until(lambda: bool(client.orders), 1.0)
        (tray,) = client.layout().trays
        wanted = client.orders[0].kits[0].objects[0].pose.position
        x, y, z = tray.tray_surface.transform((wanted.x, wanted.y, 0.0))
        start = Joints(*(client.joint_positions[name] for name in ARM_JOINTS))
        above = solve(tool_down(x, y, z + 0.15), near=start)
        down = tool_down(x, y, z + 0.03)
        way = move(start, above).then(along(straight(above, down)))
        client.send_arm(**way.command())
        client.sleep(way.duration + 0.5)
        client.control_gripper(False)
        client.sleep(5.0)


def worked(name: str, agent: Agent) -> RunResult:
    trial = load_trial([find_trial(name)]).trial
    with Session(trial, seed=SEED) as session, closing(session.node.simulation):
        return cell_result(session.run(agent))


@pytest.mark.parametrize("name", ["pick_from_bin", "pick_from_belt", "sort_faulty", "turn_over", "whole_kit"])
def test_kitter_succeeds(name: str) -> None:
    result = worked(name, find_agent("kitter")())
    assert result.success, result.error
    assert result.outcome is Outcome.DONE
    assert result.simulated == result.succeeded_at


@pytest.mark.parametrize(("name", "program"), [("reach", Reacher), ("bimanual_reach", Reacher), ("hand_over", Giver)])
def test_humanoid_succeeds(name: str, program: type[Agent]) -> None:
    result = worked(name, program())
    assert result.success, result.error
    assert result.outcome is Outcome.DONE


def test_short_program_places_the_part_that_the_cup_holds() -> None:
    result = worked("place_on_tray", Placer())
    assert result.success, result.error
