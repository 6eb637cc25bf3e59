import pytest

from benchmarks.busy_cell import BELT_PARTS, ON_BELT, busy_cell


def test_busy_cell_arm_swings_without_contact_while_parts_ride_and_rest() -> None:
    cell = busy_cell(60, 240, 4)
    model, data = cell.simulation.model, cell.simulation.data
    robot = {body for body in range(model.nbody) if model.body(model.body_rootid[body]).name == "linear_arm_actuator"}
    early = cell.parts.positions()
    for _ in range(4 * 240):
        cell.step()
        assert robot.isdisjoint(model.geom_bodyid[data.contact.geom].ravel().tolist())
    riding = [part for part in cell.world.parts if part.name.startswith(ON_BELT)]
    assert len(riding) == BELT_PARTS == len(cell.world.parts) - 60
    for part, way in zip(cell.world.parts, (cell.parts.positions() - early).tolist(), strict=True):
        if part in riding:
            assert way == pytest.approx((0.0, -0.8, -0.0005), abs=0.005)
        else:
            assert way == pytest.approx((0.0, 0.0, -0.0005), abs=2e-4)
            assert data.tree_asleep[model.body_treeid[part.body]] >= 0
    assert cell.arm is not None
    assert cell.arm.read().positions == pytest.approx(cell.arm.controller.positions(cell.simulation.now), abs=2e-3)


def test_busy_cell_without_parts_is_empty() -> None:
    assert not busy_cell(0, 240, 1, riding=0).world.parts
