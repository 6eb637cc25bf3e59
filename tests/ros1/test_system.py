"""Which ROS 1 is taken."""

import sys
from pathlib import Path

import pytest

from cellwright.errors import UsageError
from cellwright.ros1.packages import PACKAGES
from cellwright.ros1.system import RosSystem, environment, find_system, wanted
from tests.ros1.fake_system import fake_system

__all__ = ["fake_system"]


def test_a_machine_without_ros(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"no ROS 1 that can generate messages .*apt-get install") as error:
        find_system(tmp_path)
    assert "\n" not in str(error.value)


@pytest.mark.ros1
def test_the_system_of_this_machine() -> None:
    ros = find_system()
    assert ros.has_package("rospy")
    assert (ros.generators / "genmsg_py.py").is_file()
    assert not ros.has_package("osrf_gear")


def test_only_the_controllers_messages_may_be_the_systems(fake_system: RosSystem) -> None:
    assert wanted(fake_system) == list(PACKAGES)
    for package in PACKAGES:
        (fake_system.share / package).mkdir()
        (fake_system.share / package / "package.xml").write_text("<package/>")
    assert wanted(fake_system) == [name for name in PACKAGES if name != "control_msgs"]


def test_tools_do_not_see_this_pythons_modules(fake_system: RosSystem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", "/of/this/python")
    monkeypatch.setenv("PYTHONHOME", sys.prefix)
    monkeypatch.setenv("HERE", "yes")
    seen = environment(fake_system)
    assert seen["HERE"] == "yes"
    assert not {"PYTHONPATH", "PYTHONHOME"} & seen.keys()
    modules = fake_system.prefix / "lib" / "python3" / "dist-packages"
    modules.mkdir(parents=True)
    assert environment(fake_system)["PYTHONPATH"] == str(modules)
