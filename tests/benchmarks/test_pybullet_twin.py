import math
import sys
from contextlib import closing

import pytest

from benchmarks.benchmarks import BenchmarkSkippedError
from benchmarks.busy_cell import busy_cell
from benchmarks.pybullet_twin import PyBulletTwin, arm_description
from cellwright.cell.cell import Cell
from cellwright.cell.model.parts import PART_TYPES
from cellwright.config.arm import ARM_JOINTS
from cellwright.config.trial.trial import Part, Trial
from cellwright.config.ur10 import UR10
from cellwright.util.pose import Pose
from tests.support.places import BIN_CENTRES, BIN_SURFACE


def test_twin_without_pybullet_is_skipped_with_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pybullet", None)
    with pytest.raises(BenchmarkSkippedError, match="PyBullet is not installed"):
        PyBulletTwin(busy_cell(0, 240, 1), sleeping=True)


def test_twin_prints_nothing(capfd: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("pybullet")
    capfd.readouterr()  # output of the import, if this was the first
    PyBulletTwin(busy_cell(1, 240, 1), sleeping=False).close()
    print("printed")
    assert capfd.readouterr() == ("printed\n", "")


def test_arm_description_omits_empty_links() -> None:
    text = arm_description(busy_cell(0, 240, 1))
    for joint in ARM_JOINTS:
        assert text.count(f'name="{joint}"') == 1
    assert "visual" not in text
    assert "tool0" not in text
    assert "vacuum_gripper_link" in text


def test_twin_arm_has_masses_of_cell_arm() -> None:
    pytest.importorskip("pybullet")
    links = [link.inertial for link in UR10.links.values() if link.inertial is not None]
    masses = [*(link.mass for link in links[:-2]), links[-2].mass + links[-1].mass]  # the cup is one with the last link
    with closing(PyBulletTwin(busy_cell(0, 240, 1), sleeping=True)) as twin:
        assert twin.arm_masses() == pytest.approx(masses)


@pytest.mark.parametrize("sleeping", [True, False])
def test_twin_parts_come_to_rest_as_in_cell(sleeping: bool) -> None:
    pytest.importorskip("pybullet")
    places = [Pose.from_rpy((x, y, BIN_SURFACE + 0.02), (0.0, 0.0, x + y)) for x, y in BIN_CENTRES.values()]
    kinds = sorted(PART_TYPES)[: len(places)]
    parts = tuple(Part(f"bin|{kind}", kind, place) for kind, place in zip(kinds, places, strict=True))
    cell = Cell(Trial("rest", has_arm=True, bin_parts=parts), servo="precise")
    with closing(PyBulletTwin(cell, sleeping=sleeping)) as twin:
        home = cell.arm.read().positions if cell.arm else []
        assert twin.joint_positions() == pytest.approx(home)
        for part in cell.world.parts:
            assert twin.pose(part.name).position == pytest.approx(cell.parts.pose(part).position)
        for _ in range(500):
            cell.step()
            twin.step(home, [0.0] * 7)
        for part in cell.world.parts:
            ours, theirs = cell.parts.pose(part), twin.pose(part.name)
            assert theirs.position == pytest.approx(ours.position, abs=1e-3)
            apart = (ours.inverse() @ theirs).quaternion[0]
            assert 2 * math.acos(min(1.0, abs(apart))) < 0.02
        assert twin.joint_positions() == pytest.approx(home, abs=5e-3)
