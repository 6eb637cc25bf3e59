import pytest

from cellwright.cell.kitting.inventory import Faults


@pytest.mark.parametrize(
    ("name", "is_faulty"),
    [
        ("bin7|piston_rod_part_3", True),
        ("elsewhere|piston_rod_part_3", True),
        ("piston_rod_part_3", True),
        ("bin7|piston_rod_part_30", False),
        ("bin7|piston_rod_part", False),
        ("populate_conveyor|gasket_part_clone_0", True),
        ("populate_conveyor|gasket_part_clone_1", False),
    ],
)
def test_a_part_is_faulty_by_its_name_without_origin(name: str, is_faulty: bool) -> None:
    assert Faults(["piston_rod_part_3", "gasket_part_clone_0"]).is_faulty(name) is is_faulty


def test_without_faults_nothing_is_faulty() -> None:
    assert not Faults(()).is_faulty("bin7|piston_rod_part_3")
