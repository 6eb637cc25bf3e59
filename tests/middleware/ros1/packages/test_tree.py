"""Tree for a shell: complete or missing, never stale, and on the paths once."""

import os
import threading
from pathlib import Path

import pytest

from cellwright.middleware.ros1.host.installation import RosSystem
from cellwright.middleware.ros1.packages.tree import cache_folder, ensure_tree, variables
from cellwright.util.errors import UsageError
from tests.ros1.fake_system import fake_system
from tests.support.waiting import TIMEOUT

__all__ = ["fake_system"]


def test_tree_has_packages_modules_and_programs(fake_system: RosSystem, tmp_path: Path) -> None:
    tree = ensure_tree(fake_system, tmp_path / "cache")
    for path in (
        "share/osrf_gear/package.xml",
        "share/osrf_gear/config/sample.yaml",
        "share/control_msgs/msg/JointTolerance.msg",
        "share/std_msgs/msg/String.msg",
        "python/osrf_gear/msg/_Order.py",
        "python/cellwright_msgs/srv/_Step.py",
        "python/ariac_example/ariac_example.py",
        "bin/python",
    ):
        assert (tree / path).exists(), path
    assert not (tree / "share" / "geometry_msgs").exists()
    assert os.access(tree / "share" / "osrf_gear" / "script" / "gear.py", os.X_OK)
    assert str(tree / "bin") in (tree / "share" / "osrf_gear" / "env-hooks" / "50.cellwright.sh").read_text()


def test_tree_is_made_once(fake_system: RosSystem, tmp_path: Path) -> None:
    first = ensure_tree(fake_system, tmp_path)
    (first / "mark").touch()
    assert ensure_tree(fake_system, tmp_path) == first
    assert (first / "mark").exists()


@pytest.mark.slow
def test_other_system_has_other_tree(fake_system: RosSystem, tmp_path: Path) -> None:
    first = ensure_tree(fake_system, tmp_path / "cache")
    (fake_system.share / "std_msgs" / "package.xml").write_text("<package/>")
    second = ensure_tree(fake_system, tmp_path / "cache")
    assert second != first
    assert not (second / "share" / "std_msgs").exists()


def test_tree_omits_messages_of_system(fake_system: RosSystem, tmp_path: Path) -> None:
    (fake_system.share / "control_msgs").mkdir()
    (fake_system.share / "control_msgs" / "package.xml").write_text("<package/>")
    tree = ensure_tree(fake_system, tmp_path / "cache")
    assert not (tree / "share" / "control_msgs").exists()
    assert not (tree / "python" / "control_msgs").exists()


@pytest.mark.slow
def test_concurrent_calls_share_one_tree(fake_system: RosSystem, tmp_path: Path) -> None:
    trees: list[Path] = []
    threads = [
        threading.Thread(target=lambda: trees.append(ensure_tree(fake_system, tmp_path / "cache"))) for _ in range(4)
    ]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(TIMEOUT)
    assert len(trees) == 4
    assert len(set(trees)) == 1
    assert [path.name for path in (tmp_path / "cache").iterdir()] == [trees[0].name]


def test_failing_generator_leaves_no_tree(fake_system: RosSystem, tmp_path: Path) -> None:
    (fake_system.generators / "gensrv_py.py").write_text("import sys; sys.exit('no')")
    with pytest.raises(UsageError, match=r"gensrv_py\.py failed"):
        ensure_tree(fake_system, tmp_path / "cache")
    assert list((tmp_path / "cache").iterdir()) == []


def test_tree_folder_that_is_a_file_is_refused(fake_system: RosSystem, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(UsageError, match=r"file: cannot write ROS packages: "):
        ensure_tree(fake_system, tmp_path / "file")


def test_cache_folder_follows_xdg_variable(monkeypatch: pytest.MonkeyPatch) -> None:
    assert cache_folder({"XDG_CACHE_HOME": "/var/cache/me"}) == Path("/var/cache/me/cellwright/ros1")
    monkeypatch.setenv("HOME", "/home/me")
    assert cache_folder({"XDG_CACHE_HOME": "relative"}) == Path("/home/me/.cache/cellwright/ros1")


SYSTEM = RosSystem(Path("/usr"), Path("/usr/bin/python3"))


def test_variables_have_tree_first_and_once() -> None:
    new, old = Path("/cache/0.1.0-b"), Path("/cache/0.1.0-a")
    present = {"PATH": f"{old}/bin:/bin", "PYTHONPATH": "/mine", "ROS_PACKAGE_PATH": f"/ws/src:{old}/share"}
    present["CMAKE_PREFIX_PATH"] = f"{old}:/ws/devel"
    once = variables(new, SYSTEM, present)
    assert once == {
        "CMAKE_PREFIX_PATH": f"{new}:/ws/devel",
        "ROS_PACKAGE_PATH": f"{new}/share:/ws/src",
        "PYTHONPATH": f"{new}/python:/mine",
        "PATH": f"{new}/bin:/bin",
    }
    assert variables(new, SYSTEM, once) == once


def test_variables_without_package_path_include_system() -> None:
    assert variables(Path("/cache/a"), SYSTEM, {})["ROS_PACKAGE_PATH"] == "/cache/a/share:/usr/share"
