"""Choice of the ROS 1 installation."""

import sys
from pathlib import Path

import pytest

from cellwright.middleware.ros1.host import installation
from cellwright.middleware.ros1.host.installation import Installation, RosSystem, find_system, tool_environment
from cellwright.middleware.ros1.packages.contents import OF_CONTROLLERS, PACKAGES, provided_packages
from cellwright.util.errors import UsageError
from tests.ros1.fake_system import fake_system

__all__ = ["fake_system"]


def test_system_without_generators_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bare = Installation(sys.executable, {}, (tmp_path / "opt", tmp_path / "usr"))
    monkeypatch.setattr(installation, "find", lambda: bare)
    with pytest.raises(UsageError, match=r"^ROS 1 has no message generator \(genpy\); on Debian") as error:
        find_system()
    assert "\n" not in str(error.value)


def test_first_prefix_with_generators_is_used(
    fake_system: RosSystem, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = Installation("/of/ros/python3", {}, (tmp_path / "overlay", fake_system.prefix))
    monkeypatch.setattr(installation, "find", lambda: found)
    assert find_system() == RosSystem(fake_system.prefix, Path("/of/ros/python3"))


@pytest.mark.ros1
def test_system_of_this_machine_has_generators() -> None:
    ros = find_system()
    assert ros.has_package("rospy")
    assert (ros.generators / "genmsg_py.py").is_file()
    assert not ros.has_package("osrf_gear")


def test_provided_packages_omit_control_msgs_of_system(fake_system: RosSystem) -> None:
    assert provided_packages(fake_system) == list(PACKAGES)
    for package in PACKAGES:
        (fake_system.share / package).mkdir()
        (fake_system.share / package / "package.xml").write_text("<package/>")
    assert provided_packages(fake_system) == [name for name in PACKAGES if name not in OF_CONTROLLERS]


def test_tool_environment_omits_modules_of_this_python(fake_system: RosSystem, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYTHONPATH", "/of/this/python")
    monkeypatch.setenv("PYTHONHOME", sys.prefix)
    monkeypatch.setenv("HERE", "yes")
    seen = tool_environment(fake_system)
    assert seen["HERE"] == "yes"
    assert not {"PYTHONPATH", "PYTHONHOME"} & seen.keys()
    modules = fake_system.prefix / "lib" / "python3" / "dist-packages"
    modules.mkdir(parents=True)
    assert tool_environment(fake_system)["PYTHONPATH"] == str(modules)
