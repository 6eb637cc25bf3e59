"""Environment of our own: complete or not used, up to date, and made by one process at a time."""

from __future__ import annotations

import io
import json
import sys
import threading
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest

from cellwright.middleware.ros2.packages import environment
from cellwright.middleware.ros2.packages.build import MissingToolsError, requirements
from cellwright.middleware.ros2.packages.environment import (
    DISTRIBUTIONS,
    FOLDER_VARIABLE,
    check_machine,
    complete_environments,
    environment_folder,
    install,
    main,
)
from cellwright.middleware.ros2.packages.progress import Progress
from cellwright.util.errors import UsageError
from tests.support.waiting import TIMEOUT, wait_until

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="there are wheels of ROS 2 for Linux alone")


BUILT = ["build interfaces", "build varying"]
INSTALLED = ["interfaces", "varying"]


class Machine:
    """Stand-ins for pip and the builder of interfaces, in a home of their own."""

    def __init__(self, home: Path) -> None:
        self.home = home
        self.variables = {"XDG_DATA_HOME": str(home / "data"), "XDG_CACHE_HOME": str(home / "cache")}
        self.steps: list[str] = []
        self.failing = ""
        self.error: BaseException = UsageError("pip failed:\nno network")

    def pip(self, folder: Path, arguments: Sequence[str], _on_line: object = None) -> None:
        name = Path(arguments[-1]).name.partition("-")[0].rpartition("_")[2]
        self.step("wheels" if "--requirement" in arguments else name)
        assert (folder / "bin" / "python").exists()

    def build(self, _texts: object, folder: Path, wheel: Path, _report: object) -> None:
        self.step(f"build {wheel.name.partition('-')[0].rpartition('_')[2]}")
        assert (folder / "pyvenv.cfg").is_file()
        wheel.parent.mkdir(parents=True, exist_ok=True)
        wheel.touch()

    def step(self, name: str) -> None:
        self.steps.append(name)
        if self.failing == name:
            raise self.error

    def install(self, distribution: str = "jazzy", interfaces: str | None = None) -> list[str]:
        """Install, and return the steps."""
        self.steps.clear()
        install(distribution, Progress(io.StringIO(), "install"), self.variables, interfaces=interfaces)
        return self.steps

    @property
    def complete(self) -> list[tuple[str, Path]]:
        return list(complete_environments(self.variables))


@pytest.fixture
def machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Machine:
    made = Machine(tmp_path)
    monkeypatch.setattr(environment, "pip", made.pip)
    monkeypatch.setattr(environment, "build_wheel", made.build)
    monkeypatch.setattr("platform.machine", lambda: "x86_64")
    return made


def test_second_installation_does_nothing(machine: Machine) -> None:
    assert machine.install() == ["wheels", *BUILT, *INSTALLED]
    assert machine.complete == [("jazzy", machine.home / "data" / "cellwright" / "ros2-jazzy")]
    assert machine.install() == []


def test_wheel_in_cache_is_not_built_again(machine: Machine) -> None:
    machine.install()
    machine.variables["XDG_DATA_HOME"] = str(machine.home / "other")
    assert machine.install() == ["wheels", *INSTALLED]


@pytest.mark.parametrize("error", [UsageError("pip failed:\nno network"), KeyboardInterrupt()])
@pytest.mark.parametrize(
    ("failing", "then"),
    [
        ("wheels", ["wheels", *BUILT, *INSTALLED]),
        ("build interfaces", [*BUILT, *INSTALLED]),
        ("build varying", ["build varying", *INSTALLED]),
        ("interfaces", INSTALLED),
        ("varying", INSTALLED),
    ],
)
def test_interrupted_installation_is_incomplete_and_continued(
    machine: Machine, failing: str, then: list[str], error: BaseException
) -> None:
    machine.failing, machine.error = failing, error
    with pytest.raises(type(error)):
        machine.install()
    assert machine.complete == []
    machine.failing = ""
    assert machine.install() == then
    assert len(machine.complete) == 1


def test_failed_update_of_interfaces_is_incomplete(machine: Machine) -> None:
    machine.install()
    file = machine.complete[0][1] / "cellwright.json"
    file.write_text(json.dumps(json.loads(file.read_text()) | {"interfaces": "older.whl"}))
    machine.failing = "interfaces"
    with pytest.raises(UsageError, match="no network"):
        machine.install()
    assert machine.complete == []
    machine.failing = ""
    assert machine.install() == INSTALLED


def test_other_pins_make_environment_again(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    machine.install()
    kept = machine.complete[0][1] / "kept"
    kept.touch()
    monkeypatch.setattr(environment, "requirements", lambda name: f"{requirements(name)}more==1\n")
    assert machine.install() == ["wheels", *INSTALLED]
    assert not kept.exists()


def test_each_distribution_has_its_folder(machine: Machine) -> None:
    machine.install("kilted")
    machine.install("jazzy")
    assert [distribution for distribution, _ in machine.complete] == [*DISTRIBUTIONS]
    machine.variables[FOLDER_VARIABLE] = str(machine.home / "mine")
    machine.install("kilted")
    assert machine.complete == [("kilted", machine.home / "mine")]
    assert environment_folder("jazzy", machine.variables) == machine.home / "mine"


def test_common_interfaces_of_other_distribution_do_until_own_are_built(machine: Machine) -> None:
    with pytest.raises(UsageError, match="interfaces of jazzy: not built here; run scripts/install-ros2 jazzy first"):
        machine.install("kilted", interfaces="jazzy")
    assert machine.steps == []
    machine.install("jazzy")
    assert machine.install("kilted", interfaces="jazzy") == ["wheels", "build varying", *INSTALLED]
    assert [distribution for distribution, _ in machine.complete] == [*DISTRIBUTIONS]
    assert machine.install("kilted", interfaces="jazzy") == []
    assert machine.install("kilted") == ["build interfaces", *INSTALLED]
    assert machine.install("kilted", interfaces="jazzy") == []


def test_broken_interpreter_makes_environment_again(machine: Machine) -> None:
    machine.install()
    (machine.complete[0][1] / "bin" / "python").unlink()
    assert machine.install() == ["wheels", *INSTALLED]


def test_second_installer_waits_for_the_first(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    said = io.StringIO()

    def pip(folder: Path, arguments: Sequence[str], on_line: object = None) -> None:
        if "--requirement" in arguments:
            second.start()
            wait_until(said.getvalue, "line of the second")
        machine.pip(folder, arguments, on_line)

    second = threading.Thread(target=install, args=("jazzy", Progress(said, "install"), machine.variables))
    monkeypatch.setattr(environment, "pip", pip)
    machine.install()
    second.join(TIMEOUT)
    assert said.getvalue() == "install: waiting for another installation into the same folder\n"
    assert machine.steps == ["wheels", *BUILT, *INSTALLED]


def test_folder_with_other_files_is_not_removed(machine: Machine) -> None:
    mine = machine.home / "mine"
    (mine / "work").mkdir(parents=True)
    machine.variables[FOLDER_VARIABLE] = str(mine)
    with pytest.raises(UsageError, match=f"{mine}: is no virtual environment; remove it, or set {FOLDER_VARIABLE}"):
        machine.install()
    assert (mine / "work").is_dir()


def test_unwritable_folder_is_named(machine: Machine) -> None:
    (machine.home / "data").touch()
    with pytest.raises(UsageError, match=f"{machine.home}/data.*: (Not a directory|File exists)"):
        machine.install()


def test_machine_without_wheels_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(UsageError, match="humble: no wheels of this ROS 2; give one of jazzy, kilted"):
        check_machine("humble")
    monkeypatch.setattr("platform.machine", lambda: "aarch64")
    with pytest.raises(UsageError, match=r"Linux on x86_64 and Python up to 3\.14 \(got linux on aarch64, Python 3\."):
        check_machine("jazzy")


@pytest.mark.parametrize(
    ("error", "status", "said"),
    [
        (None, 0, "install-ros2: ROS 2 jazzy is there: /there (0 s)\n"),
        (MissingToolsError("requires g++; install what is missing"), 3, "install-ros2: requires g++; install what is"),
        (
            UsageError("pip failed:\nno network"),
            1,
            "install-ros2: error: pip failed:\ninstall-ros2: error: no network\n",
        ),
        (KeyboardInterrupt(), 130, "install-ros2: interrupted; the next call continues\n"),
    ],
)
def test_exit_status_tells_missing_tools_from_errors(
    error: BaseException | None,
    status: int,
    said: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def installed(*_: object, **_interfaces: object) -> Path:
        if error is not None:
            raise error
        return Path("/there")

    monkeypatch.setattr(environment, "install", installed)
    assert main([]) == status
    assert capsys.readouterr().out.startswith(said)


@pytest.mark.parametrize("word", ["humble", "--jazzy"])
def test_invalid_argument_is_refused_with_valid_ones(word: str, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        main([word])
    assert ended.value.code == 2
    said = capsys.readouterr().err
    assert word in said
    assert "jazzy,kilted" in said


def test_collected_wheels_are_progress(machine: Machine, monkeypatch: pytest.MonkeyPatch) -> None:
    shares: list[float] = []

    def pip(_folder: Path, arguments: Sequence[str], on_line: Callable[[str], None] = print) -> None:
        if "--requirement" in arguments:
            for line in requirements("jazzy").splitlines():
                on_line(f"Collecting {line}")

    monkeypatch.setattr(environment, "pip", pip)
    monkeypatch.setattr(Progress, "at", lambda _self, _name, share: shares.append(share))
    machine.install()
    assert len(shares) == len(requirements("jazzy").splitlines())
    assert shares == sorted(shares)
    assert 0.5 < shares[-1] < 1.0


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_pins_are_exact_and_of_one_list(distribution: str) -> None:
    pinned = [line.split("==") for line in requirements(distribution).splitlines()]
    assert all(len(pin) == 2 and pin[1] for pin in pinned)
    assert len({name.lower() for name, _ in pinned}) == len(pinned) > 60
    assert {"ros-rclpy", "ros-rmw-fastrtps-cpp", "ros-sensor-msgs", "ros-trajectory-msgs"} <= {
        name for name, _ in pinned
    }
