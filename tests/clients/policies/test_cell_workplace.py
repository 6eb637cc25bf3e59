"""Cells as workplaces of policies: names, and tools of robots' arms."""

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cellwright import Cell, Client, load_trial
from cellwright.clients.policies.cell_workplace import CellWorkplace, cell_names
from cellwright.config.trial.trial import Trial
from cellwright.running.run import Outcome
from tests.cell.arm_cells import TWO_UR5, ur5_cell
from tests.cell.robot_cells import tandem_cell
from tests.clients.policies.test_agent import Scripted, run, spec


@pytest.mark.parametrize("trial", [load_trial("lesson"), ur5_cell(TWO_UR5), tandem_cell(), load_trial("reach")])
def test_names_of_a_trial_are_those_of_its_cell(trial: Trial) -> None:
    place = CellWorkplace(Client.in_process(Cell(trial)))
    names = cell_names(trial)
    assert names == place.names
    assert set(place.arms) == set(names.arms)


def test_tip_of_a_robot_in_a_cell_is_where_its_link_is() -> None:
    cell = Cell(tandem_cell())
    place = CellWorkplace(Client.in_process(cell))
    readers = place.readers()
    assert place.client.wait_until(lambda: all(latest.message is not None for _, latest in readers), 1.0)
    values = [read() for read, _ in readers]
    arm = place.arms["tandem/left"]
    tip = (arm.world_T_base(values) @ arm.base_T_tool(values)).position
    assert tip == pytest.approx(tuple(cell.simulation.data.body("tandem/left_tip").xpos), abs=1e-4)


REACHES = {
    "reach": ("{pose: qinglong/right, rotation: none, frame: world}", [0.4, -0.05, 1.1]),
    "bimanual_reach": (
        "{pose: qinglong/right, rotation: none, frame: world}, {pose: qinglong/left, rotation: none, frame: world}",
        [0.4, -0.05, 1.1, 0.4, 0.2, 1.45],
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("task", REACHES)
def test_policy_that_commands_tips_succeeds_at_a_robots_task(task: str, tmp_path: Path) -> None:
    parts, goal = REACHES[task]
    file = tmp_path / "map.yaml"
    file.write_text(f"observation: {{state: {{channels: all}}}}\nactions: [{parts}]\n")

    def infer(_observation: Mapping[str, NDArray[np.float32]], _number: int) -> Sequence[Sequence[float]]:
        return [goal] * 4

    worked = run(Scripted(infer), spec(map_file=str(file), latency="100ms"), 10.0, load_trial(task))
    assert worked.result.outcome is Outcome.DONE, worked.result.error
