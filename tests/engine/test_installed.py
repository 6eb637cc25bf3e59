"""Tests of the check of the installed engine, in made-up folders of packages: pip lets two of them share a folder."""

import base64
import hashlib
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import mujoco
import pytest

from cellwright.engine.installed import check_files, check_loaded
from cellwright.util.errors import CellwrightError, InstallationError
from tests.support.waiting import TIMEOUT

CORE = "'''Version 4.0.1.'''\n"
OTHER = "'''Version 3.17.0.'''\n"
CURE = 'run: pip uninstall -y mujoco mujoco-core && pip install "mujoco-core'
MIXED = f'mujoco: another package writes to the folder of mujoco-core 4.0.1 (got mujoco 3.17.0); {CURE}==4.0.1"'


def install(site: Path, package: str, version: str, content: str) -> Path:
    """Write a package's metadata and its file as pip does: over that of another package. Return the file."""
    file = site / "mujoco" / "__init__.py"
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(content)
    digest = base64.urlsafe_b64encode(hashlib.sha256(content.encode()).digest()).rstrip(b"=").decode()
    metadata = site / f"{package}-{version}.dist-info"
    metadata.mkdir()
    (metadata / "RECORD").write_text(
        f"mujoco/_structs.so,sha256=AAAA,9\nmujoco/__init__.py,sha256={digest},{len(content)}\n"
    )
    return file


def test_file_of_core_is_accepted(tmp_path: Path) -> None:
    check_files(str(install(tmp_path, "mujoco_core", "4.0.1", CORE)))


def test_core_written_over_package_without_libraries_is_accepted(tmp_path: Path) -> None:
    install(tmp_path, "mujoco", "4.0.0", OTHER)
    check_files(str(install(tmp_path, "mujoco_core", "4.0.1", CORE)))


def test_core_written_over_package_with_libraries_is_refused(tmp_path: Path) -> None:
    """Plugins of the older one stay in the folder, and their library may be missing."""
    install(tmp_path, "mujoco", "3.17.0", OTHER)
    with pytest.raises(InstallationError) as refused:
        check_files(str(install(tmp_path, "mujoco_core", "4.0.1", CORE)))
    assert str(refused.value) == MIXED


@pytest.mark.parametrize("core", ["mujoco_core", "mujoco-core"])
def test_core_overwritten_by_other_package_is_refused(core: str, tmp_path: Path) -> None:
    install(tmp_path, core, "4.0.1", CORE)
    with pytest.raises(InstallationError) as refused:
        check_files(str(install(tmp_path, "mujoco", "3.17.0", OTHER)))
    assert str(refused.value) == MIXED


def test_core_overwritten_by_unknown_package_is_refused(tmp_path: Path) -> None:
    file = install(tmp_path, "mujoco_core", "4.0.1", CORE)
    file.write_text(OTHER)
    with pytest.raises(InstallationError, match=r"\(got files of an unknown package\)"):
        check_files(str(file))


def test_core_of_other_version_is_cured_by_one_that_runs(tmp_path: Path) -> None:
    install(tmp_path, "mujoco_core", "4.0.0", CORE)
    with pytest.raises(InstallationError, match=r'pip install "mujoco-core>=4\.0\.1,<5"$'):
        check_files(str(install(tmp_path, "mujoco", "3.17.0", OTHER)))


def test_file_without_metadata_of_core_is_left_to_check_of_versions(tmp_path: Path) -> None:
    check_files(str(install(tmp_path, "mujoco", "3.17.0", OTHER)))
    core = install(tmp_path / "unlisted", "mujoco_core", "4.0.1", CORE)
    (tmp_path / "unlisted" / "mujoco_core-4.0.1.dist-info" / "RECORD").unlink()
    check_files(str(core))


@pytest.mark.parametrize(
    ("python", "library", "got"),
    [
        ("3.17.0", "3.17.0", "mujoco 3.17.0"),
        ("4.0.0", "4.0.0", "mujoco 4.0.0"),
        ("5.0.0", "5.0.0", "mujoco 5.0.0"),
        ("4.0.1", "3.17.0", "mujoco 4.0.1 with the library 3.17.0"),
    ],
)
def test_loaded_engine_of_other_version_is_refused(python: str, library: str, got: str) -> None:
    loaded: Any = SimpleNamespace(__version__=python, __file__=None, mj_versionString=lambda: library)
    with pytest.raises(InstallationError) as refused:
        check_loaded(loaded)
    assert str(refused.value) == (
        f'mujoco: Cellwright needs the engine of mujoco-core >=4.0.1,<5 (got {got}); {CURE}>=4.0.1,<5"'
    )


@pytest.mark.parametrize("version", ["4.0.1", "4.0.2rc1", "4.1.0"])
def test_loaded_engine_of_suitable_version_is_accepted(version: str, tmp_path: Path) -> None:
    file = install(tmp_path, "mujoco_core", version, CORE)
    loaded: Any = SimpleNamespace(__version__=version, __file__=str(file), mj_versionString=lambda: version)
    check_loaded(loaded)


def test_engine_loaded_before_cellwright_is_checked_too(tmp_path: Path) -> None:
    install(tmp_path, "mujoco_core", "4.0.1", CORE)
    file = install(tmp_path, "mujoco", "4.0.0", OTHER)
    loaded: Any = SimpleNamespace(__version__="4.0.1", __file__=str(file), mj_versionString=lambda: "4.0.1")
    with pytest.raises(InstallationError, match=r"\(got mujoco 4\.0\.0\)"):
        check_loaded(loaded)


def test_engine_of_this_environment_is_accepted() -> None:
    check_files()
    check_loaded(mujoco)


def test_refusal_is_an_import_error_for_programs_that_try_the_import() -> None:
    assert issubclass(InstallationError, ImportError)
    assert issubclass(InstallationError, CellwrightError)


def cellwright(site: Path, *arguments: str) -> "subprocess.CompletedProcess[str]":
    """Run the command with a folder of packages before those of this environment."""
    program = f"import sys; sys.path.insert(0, {str(site)!r}); from cellwright.__main__ import main; sys.exit(main())"
    command = [sys.executable, "-c", program, *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=TIMEOUT, check=False, cwd=site)


def test_command_refuses_mixed_folder_before_anything_starts(tmp_path: Path) -> None:
    install(tmp_path, "mujoco_core", "4.0.1", CORE)
    install(tmp_path, "mujoco", "3.17.0", OTHER)
    ran = cellwright(tmp_path, "run", "lesson", "--record", "run.mcap")
    assert (ran.returncode, ran.stdout, ran.stderr) == (2, "", f"error: {MIXED}\n")
    assert not (tmp_path / "run.mcap").exists()


def test_folder_whose_files_were_removed_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As `pip uninstall mujoco` leaves it."""
    (tmp_path / "mujoco" / "plugin").mkdir(parents=True)
    monkeypatch.setattr(sys, "path", [str(tmp_path)])
    with pytest.raises(InstallationError) as refused:
        check_files()
    assert str(refused.value) == (
        f'mujoco: files of the engine are missing (got a folder without them); {CURE}>=4.0.1,<5"'
    )


def test_import_of_engine_checks_its_files_before_they_are_loaded(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    install(tmp_path, "mujoco_core", "4.0.1", CORE)
    install(tmp_path, "mujoco", "3.17.0", "raise AssertionError('loaded')\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "mujoco")
    with pytest.raises(InstallationError, match="another package writes to"):
        import_module("mujoco")


def test_import_of_cellwright_leaves_mixed_folder_alone(tmp_path: Path) -> None:
    """Programs under ROS's Python import it for a robot that another process simulates."""
    install(tmp_path, "mujoco_core", "4.0.1", CORE)
    install(tmp_path, "mujoco", "3.17.0", OTHER)
    assert cellwright(tmp_path, "--version").returncode == 0
