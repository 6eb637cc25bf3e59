"""Tests of the scripts that install ROS 1, ROS 2, a display and a browser, with stand-ins for the system's programs."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[2] / "scripts" / "install-ros1"
DISPLAY = SCRIPT.with_name("install-display")
BROWSER = SCRIPT.with_name("install-browser")

pytestmark = pytest.mark.skipif(os.name != "posix", reason="a script for Debian")


class Machine:
    """A folder of stand-in programs that the script finds, and the calls of each."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.calls = folder / "calls"
        self.calls.touch()
        for name in ("bash", "sed", "awk", "grep", "tee", "tail", "cat", "mktemp", "rm", "env", "true"):
            source = next(path for root in ("/usr/bin", "/bin") if (path := Path(root, name)).exists())
            (folder / name).symlink_to(source)
        self.program("dpkg-query", "exit 1")
        self.program("apt-get", "exit 0")
        self.program("id", "echo 0")

    def program(self, name: str, text: str) -> None:
        path = self.folder / name
        path.write_text(f'#!/bin/sh\necho "{name} $*" >> {self.calls}\n{text}\n')
        path.chmod(0o755)

    def run(self, *arguments: str, ci: bool = False, script: Path = SCRIPT) -> tuple[int, str]:
        done = subprocess.run(
            [str(self.folder / "bash"), str(script), *arguments],
            env={"PATH": str(self.folder), "LC_ALL": "C"} | ({"CI": "true"} if ci else {}),
            capture_output=True,
            text=True,
            timeout=30,
            check=False,
            start_new_session=True,  # a Ctrl-C goes to its group
        )
        assert done.stderr == ""
        return done.returncode, done.stdout

    def called(self, *words: str) -> int:
        """Return the number of calls with all these words."""
        return sum(set(words) <= set(line.split()) for line in self.calls.read_text().splitlines())


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def packages(script: Path = SCRIPT) -> list[str]:
    done = subprocess.run([str(script), "--list"], capture_output=True, text=True, timeout=30, check=True)
    return done.stdout.split()


def there(names: list[str]) -> str:
    return "\n".join(f"echo installed:{name}" for name in names)


def test_display_is_installed_by_apt(machine: Machine) -> None:
    assert machine.run(script=DISPLAY)[0] == 0
    assert machine.called("apt-get", "install", "--yes", "--no-install-recommends", "xvfb") == 1
    machine.program("dpkg-query", there(packages(DISPLAY)))
    assert machine.run(script=DISPLAY) == (0, "install-display: a display for tests is there\n")


def test_display_without_apt_names_remedy(machine: Machine) -> None:
    (machine.folder / "apt-get").unlink()
    status, said = machine.run(script=DISPLAY, ci=True)
    assert status == 1
    assert "the window's tests need Xvfb" in said


def test_browser_is_installed_by_apt(machine: Machine) -> None:
    assert machine.run(script=BROWSER)[0] == 0
    assert machine.called("apt-get", "install", "--yes", "--no-install-recommends", "chromium") == 1
    machine.program("dpkg-query", there(packages(BROWSER)))
    assert machine.run(script=BROWSER) == (0, "install-browser: a browser for tests is there\n")


def test_present_browser_is_not_installed_again(machine: Machine) -> None:
    machine.program("google-chrome", "exit 0")
    assert machine.run(script=BROWSER, ci=True) == (0, "install-browser: a browser for tests is there: google-chrome\n")
    assert machine.called("apt-get") == 0


def test_package_lists_name_each_package_once() -> None:
    names = packages()
    assert len(names) == len(set(names)) > 20
    assert {"ros-core", "catkin", "ros-robot-state-publisher", "libroscpp-dev"} < set(names)


@pytest.mark.parametrize("ci", [False, True])
def test_installed_packages_are_left_alone(machine: Machine, ci: bool) -> None:
    machine.program("dpkg-query", there(packages()))
    assert machine.run(ci=ci) == (0, "install-ros1: ROS 1 is there\n")
    assert not machine.called("apt-get")


def test_only_missing_packages_are_installed(machine: Machine) -> None:
    machine.program("dpkg-query", there(packages()[1:]) + "\necho config-files:ros-core")
    status, said = machine.run(ci=True)
    assert status == 0
    assert "installing 1 packages" in said
    assert machine.called("apt-get", "install", "--yes", "--no-install-recommends", "ros-core") == 1
    assert not machine.called("apt-get", "catkin")
    assert not machine.called("update")


@pytest.mark.parametrize("ci", [False, True])
def test_apt_skips_disk_sync_in_ci_only(machine: Machine, ci: bool) -> None:
    assert machine.run(ci=ci)[0] == 0
    assert machine.called("install", "--yes", "Dpkg::Options::=--force-unsafe-io") == ci


def test_installation_prints_progress(machine: Machine) -> None:
    machine.program("apt-get", "i=0; while [ $i -lt 120 ]; do echo 'Setting up ros (1)'; i=$((i+1)); done")
    status, said = machine.run()
    assert status == 0
    assert [line for line in said.splitlines() if "ready" in line] == ["  50 packages ready", "  100 packages ready"]


def test_outdated_package_lists_are_updated(machine: Machine) -> None:
    machine.program(
        "apt-get", f'case "$*" in *update*) : >{machine.folder}/new;; *) [ -e {machine.folder}/new ] || exit 100;; esac'
    )
    status, said = machine.run(ci=True)
    assert status == 0
    assert "reading the package lists" in said
    assert machine.called("apt-get", "update") == 1
    assert machine.called("apt-get", "install", "--yes") == 1


@pytest.mark.parametrize("ci", [False, True])
def test_user_without_rights_gets_command_to_type(machine: Machine, ci: bool) -> None:
    machine.program("id", "echo 1000")
    machine.program("sudo", "exit 1")
    status, said = machine.run(ci=ci)
    assert status == (1 if ci else 0)
    assert "as root: apt-get update && apt-get install --no-install-recommends ros-core" in said
    assert said.count("\n") == 1
    assert not machine.called("apt-get")


def test_sudo_without_password_is_used(machine: Machine) -> None:
    machine.program("id", "echo 1000")
    machine.program("sudo", 'shift; exec "$@"')
    status, _ = machine.run(ci=True)
    assert status == 0
    assert machine.called("sudo", "-n", "apt-get", "--yes") == 1


@pytest.mark.parametrize("ci", [False, True])
def test_failed_installation_shows_apt_error(machine: Machine, ci: bool) -> None:
    machine.program("apt-get", "echo 'E: no network'; exit 100")
    status, said = machine.run(ci=ci)
    assert status == (1 if ci else 0)
    assert "E: no network" in said
    assert "could not install ROS 1; by hand, as root: apt-get update &&" in said


@pytest.mark.parametrize("ci", [False, True])
def test_system_without_apt_gets_message(machine: Machine, ci: bool) -> None:
    (machine.folder / "apt-get").unlink()
    status, said = machine.run(ci=ci)
    assert status == (1 if ci else 0)
    assert "there is no apt-get here" in said


def test_run_packages_hold_no_compiler() -> None:
    done = subprocess.run([str(SCRIPT), "--run", "--list"], capture_output=True, text=True, timeout=30, check=True)
    run = done.stdout.split()
    assert {"ros-core", "ros-robot-state-publisher"} <= set(run) < set(packages())
    assert not {"catkin", "cmake", "g++"} & set(run)


@pytest.fixture
def ros2(machine: Machine) -> Path:
    """Return a copy of the script for ROS 2, beside a Python that lacks tools until apt has run."""
    scripts = machine.folder / "checkout" / "scripts"
    scripts.mkdir(parents=True)
    for name in ("install-ros2", "packages.sh"):
        shutil.copy(SCRIPT.with_name(name), scripts)
    python = machine.folder / "checkout" / ".venv" / "bin" / "python"
    python.parent.mkdir(parents=True)
    python.write_text(f'#!/bin/sh\necho "python $*" >> {machine.calls}\n[ -e {machine.folder}/tools ] || exit 3\n')
    python.chmod(0o755)
    machine.program("apt-get", f'case "$*" in *--yes*) : >{machine.folder}/tools;; esac')
    return scripts / "install-ros2"


def test_ros2_installs_tools_only_where_they_are_missing(machine: Machine, ros2: Path) -> None:
    assert machine.run("kilted", script=ros2, ci=True)[0] == 0
    assert machine.called("apt-get", "install", "--yes", "g++", "python3-dev") == 1
    assert machine.called("python", "cellwright.middleware.ros2.packages.environment", "kilted") == 2
    machine.calls.write_text("")
    assert machine.run(script=ros2, ci=True) == (0, "")
    assert machine.called("python") == 1
    assert not machine.called("apt-get")


@pytest.mark.parametrize("ci", [False, True])
def test_ros2_without_rights_gets_command_to_type(machine: Machine, ros2: Path, ci: bool) -> None:
    machine.program("id", "echo 1000")
    machine.program("sudo", "exit 1")
    status, said = machine.run(script=ros2, ci=ci)
    assert status == (1 if ci else 0)
    assert "as root: apt-get update && apt-get install --no-install-recommends g++ python3-dev" in said
    assert not machine.called("apt-get")


@pytest.mark.parametrize("ci", [False, True])
def test_ros2_without_apt_or_environment_says_so(machine: Machine, ros2: Path, ci: bool) -> None:
    (machine.folder / "apt-get").unlink()
    status, said = machine.run(script=ros2, ci=ci)
    assert (status, said) == (
        ci,
        "install-ros2: there is no apt-get here; install what is missing, and run this again\n",
    )
    shutil.rmtree(machine.folder / "checkout" / ".venv")
    status, said = machine.run(script=ros2, ci=ci)
    assert (status, said) == (ci, "install-ros2: there is no .venv here; run: make dev\n")


@pytest.mark.parametrize("ci", [False, True])
@pytest.mark.parametrize("status", [2, 130])
def test_ros2_with_bad_arguments_or_interrupted_has_its_status(
    machine: Machine, ros2: Path, status: int, ci: bool
) -> None:
    python = machine.folder / "checkout" / ".venv" / "bin" / "python"
    python.write_text(f"#!/bin/sh\nexit {status}\n")
    assert machine.run("--jazzy", script=ros2, ci=ci) == (status, "")
    assert not machine.called("apt-get")


@pytest.mark.parametrize("ci", [False, True])
@pytest.mark.parametrize("script", [SCRIPT, DISPLAY, BROWSER], ids=lambda each: each.name)
def test_unknown_arguments_are_refused_with_valid_ones(machine: Machine, script: Path, ci: bool) -> None:
    takes = "--run, " if script == SCRIPT else ""
    name = script.name
    assert machine.run("humble", script=script, ci=ci) == (
        2,
        f"{name}: humble: not valid (give {takes}--list, or nothing)\n",
    )
    assert machine.run("--list", "jazzy", script=script, ci=ci)[0] == 2
    assert not machine.called("apt-get")


CTRL_C = "kill -INT 0; exit 100"
"""Ctrl-C of a terminal, which reaches the whole group; apt then ends as after any failure."""


@pytest.mark.parametrize("script", [SCRIPT, DISPLAY, BROWSER], ids=lambda each: each.name)
def test_ctrl_c_ends_installation_with_130(machine: Machine, script: Path) -> None:
    machine.program("apt-get", f"trap '' INT; {CTRL_C}")
    status, said = machine.run(script=script)
    assert status == 130
    assert "could not install" not in said
    assert machine.called("apt-get") == 1


def test_ctrl_c_ends_installation_of_tools_for_ros2_with_130(machine: Machine, ros2: Path) -> None:
    machine.program("apt-get", f"trap '' INT; {CTRL_C}")
    status, said = machine.run(script=ros2)
    assert status == 130
    assert "could not install" not in said
    assert machine.called("apt-get") == 1
    assert machine.called("python") == 1


@pytest.mark.parametrize("ci", [False, True])
def test_failed_ros2_is_an_error_in_ci_alone(machine: Machine, ros2: Path, ci: bool) -> None:
    python = machine.folder / "checkout" / ".venv" / "bin" / "python"
    python.write_text("#!/bin/sh\necho 'install-ros2: error: pip failed:'\nexit 1\n")
    status, said = machine.run(script=ros2, ci=ci)
    assert status == ci
    assert said == "install-ros2: error: pip failed:\ninstall-ros2: ROS 2 is not installed; see above\n"
    assert not machine.called("apt-get")
