"""Wheel of the interfaces: its name stands for its sources, and it appears whole or not at all."""

from __future__ import annotations

import csv
import os
import subprocess
import sys
import sysconfig
import threading
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.ros2.packages import build
from cellwright.middleware.ros2.packages.build import MissingToolsError, build_wheel, missing_tools, wheel_path
from cellwright.middleware.ros2.packages.contents import definitions
from cellwright.util.errors import UsageError
from tests.waiting import TIMEOUT

TEXTS = {
    "small_msgs": {"msg/One.msg": "large_msgs/Two two\n"},
    "large_msgs": {f"msg/{name}.msg": "float64 x\n" for name in ("Two", "Three", "Four")},
    "other_msgs": {"msg/Five.msg": "std_msgs/Header header\n"},
}


def key(texts: Mapping[str, Mapping[str, str]] | None = None, **variables: str) -> str:
    return wheel_path("jazzy", texts, variables).name


@given(st.data())
def test_key_changes_with_any_definition(data: st.DataObject) -> None:
    texts = {package: dict(each) for package, each in definitions().items()}
    package = data.draw(st.sampled_from(sorted(texts)))
    path = data.draw(st.sampled_from(sorted(texts[package])))
    texts[package][path] += data.draw(st.sampled_from(["\n", "# more\n", "float64 more\n"]))
    assert key(texts) != key()


def test_key_changes_with_name_of_a_definition() -> None:
    renamed = {"msg/Six.msg": "float64 x\n"}
    assert key({"a": renamed}) != key({"a": {"msg/Five.msg": "float64 x\n"}}) != key({"b": renamed})


def test_key_changes_with_distribution_and_nothing_around(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = key()
    monkeypatch.chdir(tmp_path)
    for name, value in (("PATH", "/nowhere"), ("HOME", str(tmp_path)), ("ROS_DISTRO", "humble"), ("LANG", "C")):
        monkeypatch.setenv(name, value)
    assert key(XDG_CACHE_HOME=str(tmp_path)) == key(XDG_DATA_HOME="/data") == before
    assert wheel_path("kilted").name != before
    assert wheel_path("jazzy", variables={"XDG_CACHE_HOME": "/big"}).parent == Path("/big/cellwright/ros2")


class Builder:
    """Stand-in for pip and cmake, which installs a package as its generators do."""

    def __init__(self) -> None:
        self.begun: list[str] = []
        self.installed: list[str] = []
        self.bad = ""
        self.most = 0
        self._now = 0
        self._lock = threading.Lock()

    def run(self, command: Sequence[str], what: str, variables: Mapping[str, str]) -> str:
        if command[0] != "cmake":
            return "/venv/lib\n"
        assert variables["_ROS_WHEELS_BOOTSTRAP_COMPLETE"] == "1"
        if "-S" in command:
            source = Path(command[command.index("-S") + 1])
            assert (source / "package.xml").is_file()
            with self._lock:
                self.begun.append(what)
                self._now += 1
                self.most = max(self.most, self._now)
        if what == self.bad:
            raise UsageError(f"{what}: cmake failed:\nno such type")
        if "--install" in command:
            work = Path(command[2]).parents[1]
            prefix = work / "prefix"
            python = f"lib/python{sys.version_info[0]}.{sys.version_info[1]}/site-packages"
            for path in (
                f"{python}/{what}/__init__.py",
                f"{python}/{what}-0.1.0.egg-info/PKG-INFO",
                f"include/{what}/msg/one.h",
                f"lib/lib{what}.so",
                f"share/{what}/package.xml",
                f"share/{what}/cmake/{what}Config.cmake",
            ):
                (prefix / path).parent.mkdir(parents=True, exist_ok=True)
                (prefix / path).write_text(path)
            with self._lock:
                self.installed.append(what)
                self._now -= 1
        return ""


@pytest.fixture
def builder(monkeypatch: pytest.MonkeyPatch) -> Builder:
    made = Builder()
    monkeypatch.setattr(build, "run", made.run)
    monkeypatch.setattr(build, "pip", lambda *_: None)
    monkeypatch.setattr(build, "missing_tools", list)
    monkeypatch.setattr(build, "definitions", lambda: TEXTS)
    return made


def test_packages_are_built_after_those_they_use_and_two_at_once(builder: Builder, tmp_path: Path) -> None:
    lines: list[str] = []
    build_wheel("jazzy", tmp_path, tmp_path / "cache" / "a-1-cp-cp-linux.whl", lines.append)
    assert "large_msgs" in builder.begun[:2]
    assert builder.installed.index("large_msgs") < builder.begun.index("small_msgs")
    assert sorted(builder.installed) == sorted(TEXTS)
    assert builder.most <= 2
    assert [line for line in lines if "(3 of 3)" in line]


def test_wheel_has_modules_and_libraries_but_no_headers(builder: Builder, tmp_path: Path) -> None:
    wheel = wheel_path("jazzy", variables={"XDG_CACHE_HOME": str(tmp_path)})
    build_wheel("jazzy", tmp_path, wheel, lambda _: None)
    archive = zipfile.ZipFile(wheel)
    inside = archive.namelist()
    stem = "-".join(wheel.name.split("-")[:2])
    assert {name for name in inside if "large_msgs" in name} == {
        "large_msgs/__init__.py",
        f"{stem}.data/data/lib/liblarge_msgs.so",
        f"{stem}.data/data/share/large_msgs/package.xml",
    }
    record = list(csv.reader(archive.read(f"{stem}.dist-info/RECORD").decode().splitlines()))
    assert [row[0] for row in record] == inside
    assert all(int(size) == archive.getinfo(name).file_size for name, _, size in record[:-1])
    first = wheel.read_bytes()
    build_wheel("jazzy", tmp_path, wheel, lambda _: None)
    assert wheel.read_bytes() == first


def test_pip_installs_wheel_into_environment(builder: Builder, tmp_path: Path) -> None:
    wheel = wheel_path("jazzy", variables={"XDG_CACHE_HOME": str(tmp_path)})
    build_wheel("jazzy", tmp_path, wheel, lambda _: None)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(tmp_path / "venv")], check=True, timeout=TIMEOUT)
    pip = [sys.executable, "-m", "pip", "--python", str(tmp_path / "venv" / "bin" / "python"), "install", "--quiet"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    subprocess.run([*pip, "--no-deps", str(wheel)], check=True, timeout=TIMEOUT, env=environment)
    assert (tmp_path / "venv" / "lib" / "liblarge_msgs.so").is_file()
    assert list((tmp_path / "venv").glob("lib/python*/site-packages/small_msgs/__init__.py"))


def test_failed_package_leaves_no_wheel_and_begins_no_other(builder: Builder, tmp_path: Path) -> None:
    builder.bad = "large_msgs"
    wheel = tmp_path / "cache" / "a-1-cp-cp-linux.whl"
    with pytest.raises(UsageError, match=r"large_msgs: cmake failed:\nno such type"):
        build_wheel("jazzy", tmp_path, wheel, lambda _: None)
    assert list(wheel.parent.iterdir()) == []
    assert "small_msgs" not in builder.begun


def test_missing_tools_are_named_before_anything_is_built(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setattr(build, "run", lambda *_: pytest.fail("a program was started"))
    assert missing_tools()[:3] == ["cmake", "ninja", "g++"]
    with pytest.raises(MissingToolsError, match=r"building the interfaces requires cmake, ninja, g\+\+"):
        build_wheel("jazzy", tmp_path, tmp_path / "cache" / "wheel.whl", lambda _: None)
    assert not (tmp_path / "cache").exists()


def test_headers_of_build_machine_are_replaced(tmp_path: Path) -> None:
    numpy = tmp_path / "lib" / "python3.11" / "site-packages" / "numpy" / "_core" / "include"
    numpy.mkdir(parents=True)
    export = tmp_path / "share" / "std_msgs" / "cmake" / "export.cmake"
    export.parent.mkdir(parents=True)
    there = "/opt/python/cp311-cp311"
    text = 'INCLUDE "{};{}"\n'
    export.write_text(
        text.format(f"{there}/include/python3.11", f"{there}/lib/python3.11/site-packages/numpy/_core/include")
    )
    build._name_own_headers(tmp_path, tmp_path)
    assert export.read_text() == text.format(sysconfig.get_paths()["include"], numpy)


def test_failed_program_shows_its_last_lines() -> None:
    program = "print('\\n'.join(map(str, range(99)))); raise SystemExit(1)"
    with pytest.raises(UsageError) as caught:
        build.run([sys.executable, "-c", program], "osrf_gear", os.environ)
    lines = str(caught.value).splitlines()
    assert lines[0] == f"osrf_gear: {Path(sys.executable).name} failed:"
    assert lines[-1] == "98"
    assert len(lines) == 21
    with pytest.raises(UsageError, match=r"^pip: /no/such/program: cannot be started: No such file"):
        build.run(["/no/such/program"], "pip", os.environ)
