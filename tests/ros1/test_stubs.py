"""Stubs: definitions without a manifest get one."""

import xml.etree.ElementTree as ET
from pathlib import Path

import pytest

from cellwright.middleware.ros1.packages.tree import packages_without_manifest, write_stubs
from tests.ros1.ground import Ground

pytest_plugins = ["tests.ros1.fixtures"]


@pytest.fixture
def share(tmp_path: Path) -> Path:
    """Packages: two without a manifest, one with, one without definitions."""
    share = tmp_path / "share"
    for path in (
        "a_msgs/msg/A.msg",
        "a_msgs/srv/A.srv",
        "b_srvs/srv/B.srv",
        "c_msgs/msg/C.msg",
        "c_msgs/package.xml",
        "d/msg/readme.txt",
    ):
        (share / path).parent.mkdir(parents=True, exist_ok=True)
        (share / path).write_text("string data\n")
    return share


def test_packages_without_manifest_are_found(share: Path) -> None:
    assert packages_without_manifest(share) == ["a_msgs", "b_srvs"]
    assert packages_without_manifest(share / "none") == []


def test_stubs_link_to_definitions(share: Path, tmp_path: Path) -> None:
    packages = tmp_path / "packages"
    assert write_stubs(share, packages) == ["a_msgs", "b_srvs"]
    for name in ("a_msgs", "b_srvs"):
        assert ET.parse(packages / name / "package.xml").getroot().findtext("name") == name
    assert (packages / "a_msgs" / "msg" / "A.msg").read_text() == "string data\n"
    assert not (packages / "b_srvs" / "msg").exists()
    assert packages_without_manifest(packages) == []


@pytest.mark.ros1
def test_rosmsg_shows_package_without_manifest(share: Path, tmp_path: Path, no_master: Ground) -> None:
    write_stubs(share, tmp_path / "packages")
    shown = no_master.tool("rosmsg", "show", "a_msgs/A", ROS_PACKAGE_PATH=str(tmp_path / "packages"))
    assert shown.strip() == "string data"
    assert no_master.tool("rospack", "find", "b_srvs", ROS_PACKAGE_PATH=str(tmp_path / "packages")).strip() == str(
        tmp_path / "packages" / "b_srvs"
    )
