"""Drivers from files and modules: look-up, and errors in one line."""

from pathlib import Path

import pytest

from cellwright.robot.drivers import DriverError, find_driver
from tests.robot.robots import two_arms

EXAMPLE = Path(__file__).parents[3] / "examples" / "my_driver.py"

DRIVERS = """
class Broken:
    def __init__(self, config):
        raise OSError(f"no {config.name} at\\n192.168.0.7")

    def command(self, targets):
        pass

class NoDriver:
    pass
"""


@pytest.fixture
def drivers(tmp_path: Path) -> Path:
    file = tmp_path / "drivers.py"
    file.write_text(DRIVERS)
    return file


def test_class_path_in_file_gives_driver() -> None:
    driver = find_driver(f"{EXAMPLE}:MyDriver")(two_arms())
    assert "lift" in driver.joints


def test_invalid_class_path_is_refused_with_hint(drivers: Path) -> None:
    for name, reason in {
        "two_arms": "path.py:Class",
        f"{drivers.with_name('none.py')}:MyDriver": "there is no such file",
        f"{drivers}:Brocken": "did you mean Broken",
        f"{drivers}:NoDriver": "not a driver; give a class with joints",
        "no_such_module_of_mine:Driver": "cannot be imported: ModuleNotFoundError",
    }.items():
        with pytest.raises(DriverError, match=reason):
            find_driver(name)


def test_failing_constructor_gives_driver_error(drivers: Path) -> None:
    with pytest.raises(DriverError, match=r"drivers.py:Broken: cannot be made: OSError: no two_arms at 192.168.0.7$"):
        find_driver(f"{drivers}:Broken")(two_arms())
