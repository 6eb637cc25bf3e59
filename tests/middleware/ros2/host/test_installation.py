"""Finding an interpreter that has rclpy."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

from cellwright.middleware.ros2.host.installation import PYTHON_VARIABLE, find
from cellwright.middleware.ros2.packages.contents import interface_packages
from cellwright.util.errors import UsageError

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="made with scripts of a shell")


class Machine:
    """A machine without ROS 2: its root, its home, and the environment of a shell."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.root = folder / "opt" / "ros"
        self.shell = {"PATH": f"{folder}/usr/bin:/usr/bin:/bin", "XDG_DATA_HOME": str(folder / "data")}
        self.python("usr/bin", "exit 1")

    def python(self, folder: str, text: str) -> str:
        """Write a `python3` that runs a text of the shell."""
        path = self.folder / folder / "python3"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(f"#!/bin/sh\n{text}\n")
        path.chmod(0o755)
        return str(path)

    def distribution(self, name: str, ros: int = 2) -> None:
        """Install a distribution, whose Python works once its setup is sourced."""
        folder = self.root / name
        self.python(f"opt/ros/{name}/bin", f'[ "$ROS_DISTRO" = {name} ] || exit 1\n{answer()}')
        (folder / "setup.bash").write_text(
            f"echo noise; export ROS_VERSION={ros} ROS_DISTRO={name} PATH={folder}/bin:$PATH SHLVL=9 LINES='a\nb'\n"
        )
        if ros == 1:
            (folder / "bin" / "rosmaster").touch(mode=0o755)

    def own(self, distribution: str, *, interfaces: str = "some.whl") -> Path:
        """Make an environment of our own."""
        folder = self.folder / "data" / "cellwright" / f"ros2-{distribution}"
        version = {"jazzy": "7.1.6", "kilted": "9.1.2"}[distribution]
        self.python(f"data/cellwright/ros2-{distribution}/bin", answer(wheel=version))
        contents = {"distribution": distribution, "interfaces": interfaces}
        (folder / "cellwright.json").write_text(json.dumps(contents))
        return folder


def answer(*missing: str, wheel: str = "") -> str:
    """Return the line of a shell with the answer of an interpreter that has rclpy."""
    return f"echo 'a warning'; echo '{json.dumps({'missing': missing, 'wheel': wheel})}'"


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_missing_installation_error_has_instructions(machine: Machine) -> None:
    with pytest.raises(UsageError) as caught:
        find(machine.shell, root=machine.root)
    said = str(caught.value)
    assert "\n" not in said
    for word in ("rclpy", "scripts/install-ros2", "source its setup", PYTHON_VARIABLE):
        assert word in said


def test_python_named_by_variable_is_used_alone(machine: Machine) -> None:
    machine.own("jazzy")
    good, bad = machine.python("good", answer(wheel="9.1.2")), machine.python("bad", "exit 1")
    silent, odd = machine.python("silent", "exit 0"), machine.python("odd", "echo 3")
    found = find(machine.shell | {PYTHON_VARIABLE: good}, root=machine.root)
    assert (found.python, found.distribution) == (good, "kilted")
    for name in (bad, silent, odd, "/no/such/python"):
        with pytest.raises(UsageError, match=f"{PYTHON_VARIABLE} is {name}, which has no rclpy"):
            find(machine.shell | {PYTHON_VARIABLE: name}, root=machine.root)


@pytest.mark.parametrize("sign", [{"ROS_VERSION": "2"}, {"AMENT_PREFIX_PATH": "/opt/ros/humble"}])
def test_python_of_sourced_shell_comes_before_others(machine: Machine, sign: dict[str, str]) -> None:
    machine.distribution("jazzy")
    machine.own("jazzy")
    python = machine.python("usr/bin", answer("osrf_gear", "tf2_msgs"))
    shell = machine.shell | sign | {"ROS_DISTRO": "humble", "PYTHONPATH": "/ws", "LD_LIBRARY_PATH": "/ws/lib"}
    found = find(shell | {"PYTHONHOME": "/nowhere"}, root=machine.root)
    assert (found.python, found.distribution) == (python, "humble")
    assert found.environment == shell
    assert found.missing_interfaces == ("osrf_gear", "tf2_msgs")


def test_later_python_on_path_is_found(machine: Machine) -> None:
    machine.python("venv/bin", "exit 1")
    python = machine.python("usr/bin", answer())
    shell = machine.shell | {"ROS_VERSION": "2", "PATH": f"{machine.folder}/venv/bin:{machine.shell['PATH']}"}
    assert find(shell, root=machine.root).python == python


def test_shell_of_ros1_is_not_asked(machine: Machine) -> None:
    machine.python("usr/bin", answer())
    with pytest.raises(UsageError, match="no Python here has rclpy"):
        find(machine.shell | {"ROS_VERSION": "1", "AMENT_PREFIX_PATH": "/ws"}, root=machine.root)


@pytest.mark.parametrize(
    ("installed", "expected"),
    [
        (["humble", "kilted", "jazzy"], "jazzy"),
        (["humble", "kilted", "rolling"], "kilted"),
        (["humble", "iron"], "iron"),
        (["humble"], "humble"),
    ],
)
def test_distribution_under_opt_is_sourced_in_order(machine: Machine, installed: list[str], expected: str) -> None:
    for name in installed:
        machine.distribution(name)
    machine.distribution("noetic", ros=1)
    machine.own("jazzy")
    found = find(machine.shell | {"SHLVL": "1", "KEPT": "1"}, root=machine.root)
    assert found.python == str(machine.root / expected / "bin" / "python3")
    assert found.distribution == expected
    assert found.environment["LINES"] == "a\nb"
    assert (found.environment["SHLVL"], found.environment["KEPT"]) == ("1", "1")
    assert "_" not in found.environment


def test_own_environment_is_last_and_without_modules_of_others(machine: Machine) -> None:
    machine.own("kilted")
    folder = machine.own("jazzy")
    shell = machine.shell | {"PYTHONPATH": "/opt/ros/noetic/lib/python3", "ROS_DISTRO": "noetic", "ROS_VERSION": "1"}
    found = find(shell, root=machine.root)
    assert found.python == str(folder / "bin" / "python3")
    assert found.distribution == "jazzy"
    assert found.missing_interfaces == found.notes == ()
    assert found.environment == machine.shell | {
        "AMENT_PREFIX_PATH": str(folder),
        "PATH": f"{folder}/bin:{machine.shell['PATH']}",
        "ROS_DISTRO": "jazzy",
        "ROS_PYTHON_VERSION": "3",
        "ROS_VERSION": "2",
    }
    assert find(found.environment, root=machine.root) == found


def test_incomplete_environment_is_not_used(machine: Machine) -> None:
    machine.own("jazzy", interfaces="")
    folder = machine.own("kilted")
    assert find(machine.shell, root=machine.root).python == str(folder / "bin" / "python3")


def test_variables_of_other_wheels_are_dropped(machine: Machine) -> None:
    machine.own("jazzy")
    bootstrapped = machine.shell | {"_ROS_WHEELS_BOOTSTRAP_COMPLETE": "1", "LD_LIBRARY_PATH": "/other/lib"}
    environment = find(bootstrapped, root=machine.root).environment
    assert not {"_ROS_WHEELS_BOOTSTRAP_COMPLETE", "LD_LIBRARY_PATH"} & set(environment)
    mine = find(machine.shell | {"LD_LIBRARY_PATH": "/mine"}, root=machine.root).environment
    assert mine["LD_LIBRARY_PATH"] == "/mine"


def test_middleware_that_wheels_lack_is_dropped_with_a_note(machine: Machine) -> None:
    machine.own("jazzy")
    found = find(machine.shell | {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, root=machine.root)
    assert "RMW_IMPLEMENTATION" not in found.environment
    (note,) = found.notes
    assert note.startswith("RMW_IMPLEMENTATION=rmw_cyclonedds_cpp is ignored: ")
    kept = find(machine.shell | {"RMW_IMPLEMENTATION": "rmw_fastrtps_cpp"}, root=machine.root)
    assert kept.environment["RMW_IMPLEMENTATION"] == "rmw_fastrtps_cpp"
    assert kept.notes == ()


def test_middleware_of_a_distribution_stays(machine: Machine) -> None:
    machine.distribution("humble")
    found = find(machine.shell | {"RMW_IMPLEMENTATION": "rmw_cyclonedds_cpp"}, root=machine.root)
    assert found.environment["RMW_IMPLEMENTATION"] == "rmw_cyclonedds_cpp"


def test_interpreter_is_asked_for_all_interfaces(machine: Machine) -> None:
    log = machine.folder / "log"
    python = machine.python("asked", f'shift 2; echo "$@" > {log}; {answer()}')
    find(machine.shell | {PYTHON_VARIABLE: python}, root=machine.root)
    assert log.read_text().split() == interface_packages()


@pytest.mark.parametrize("domain", ["300", "233", "abc", "-1", "1.5", "٣", " "])
def test_invalid_domain_is_refused_before_anything_starts(machine: Machine, domain: str) -> None:
    machine.own("jazzy")
    with pytest.raises(UsageError) as refused:
        find({**machine.shell, "ROS_DOMAIN_ID": domain}, root=machine.root)
    assert str(refused.value) == (
        "ROS_DOMAIN_ID: must be a whole number from 0 to 232, since higher domains have no ports "
        f"(got {domain!r}); set another, or unset it"
    )


@pytest.mark.parametrize("domain", ["", "0", "007", "232"])
def test_valid_domain_is_kept(machine: Machine, domain: str) -> None:
    machine.own("jazzy")
    assert find({**machine.shell, "ROS_DOMAIN_ID": domain}, root=machine.root).environment["ROS_DOMAIN_ID"] == domain
