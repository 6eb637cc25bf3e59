"""Wheel of the interfaces: its name stands for its sources, and it appears whole or not at all."""

from __future__ import annotations

import csv
import io
import os
import subprocess
import sys
import threading
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.middleware.ros2.packages import build
from cellwright.middleware.ros2.packages.build import (
    COMMON,
    VARYING,
    MissingToolsError,
    Texts,
    build_wheel,
    expected_steps,
    missing_tools,
    packages_of,
    wheel_path,
)
from cellwright.middleware.ros2.packages.contents import definitions, dependencies
from cellwright.middleware.ros2.packages.progress import Progress
from cellwright.util.errors import UsageError
from tests.support.waiting import TIMEOUT

TEXTS = {
    "small_msgs": {"msg/One.msg": "large_msgs/Two two\n"},
    "large_msgs": {f"msg/{name}.msg": "float64 x\n" for name in ("Two", "Three", "Four")},
    "other_msgs": {"msg/Five.msg": "std_msgs/Header header\n"},
}


WHEEL = Path("a-1-cp-cp-linux.whl")


def key(texts: Texts | None = None, **variables: str) -> str:
    return wheel_path(COMMON, "jazzy", packages_of(COMMON, "jazzy") if texts is None else texts, variables).name


@given(st.data())
def test_key_changes_with_any_definition(data: st.DataObject) -> None:
    texts = {package: dict(each) for package, each in packages_of(COMMON, "jazzy").items()}
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
    assert wheel_path(COMMON, "kilted", packages_of(COMMON, "kilted")).name != before
    assert wheel_path(COMMON, "jazzy", {}, {"XDG_CACHE_HOME": "/big"}).parent == Path("/big/cellwright/ros2")


@pytest.mark.parametrize("distribution", ["jazzy", "kilted"])
def test_each_package_is_in_one_wheel_and_uses_none_of_the_other(distribution: str) -> None:
    common, varying = packages_of(COMMON, distribution), packages_of(VARYING, distribution)
    assert {**common, **varying} == definitions(distribution)
    assert not common.keys() & varying.keys()
    for texts, other in ((common, varying), (varying, common)):
        assert not {used for name, each in texts.items() for used in dependencies(name, each)} & other.keys()


def test_only_the_varying_wheel_depends_on_the_definitions_of_a_distribution() -> None:
    assert packages_of(COMMON, "jazzy") == packages_of(COMMON, "kilted")
    assert packages_of(VARYING, "jazzy").keys() == packages_of(VARYING, "kilted").keys()
    assert packages_of(VARYING, "jazzy") != packages_of(VARYING, "kilted") == packages_of(VARYING, "rolling")


class Builder:
    """Stand-in for the generators and the compiler, which write the files that those write."""

    def __init__(self) -> None:
        self.ran: list[str] = []
        self.order: list[str] = []
        self.bad = ""
        self.most = 0
        self._now = 0
        self._lock = threading.Lock()

    def run(
        self, command: Sequence[str], what: str, _variables: Mapping[str, str], on_line: Callable[[str], None] = print
    ) -> None:
        with self._lock:
            self.ran.append(what)
            self._now += 1
            self.most = max(self.most, self._now)
        if what == self.bad:
            raise UsageError(f"{what}: g++ failed:\nno such type")
        if "-o" in command:
            Path(command[command.index("-o") + 1]).write_text(what)
        else:
            work, self.order = Path(command[2]), [*command[4:]]
            for package in self.order:
                self.generate(package, work / "gen" / package)
                on_line(f"done: {package}")
        with self._lock:
            self._now -= 1

    def generate(self, package: str, out: Path) -> None:
        for path in TEXTS[package]:
            assert (out.parents[1] / "src" / package / path).read_text() == TEXTS[package][path]
            stem = (out / path).with_suffix("")
            stem.parent.mkdir(parents=True, exist_ok=True)
            for name in (f"{stem}.idl", f"{stem}.json", f"{stem}_s.c", f"{stem.parent}/__init__.py"):
                Path(name).write_text(package)
        (out / "__init__.py").touch()
        (out / f"_{package}_s.ep.rosidl_typesupport_c.c").touch()


@pytest.fixture
def builder(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Builder:
    made = Builder()
    for name in ("include", "lib"):
        (tmp_path / name).mkdir()
    monkeypatch.setattr(build, "run", made.run)
    monkeypatch.setattr(build, "missing_tools", list)
    return made


@pytest.fixture
def progress() -> Progress:
    made = Progress(io.StringIO(), "install")
    made.plan(expected_steps(TEXTS, WHEEL))
    return made


def test_packages_are_generated_after_those_they_use(builder: Builder, progress: Progress, tmp_path: Path) -> None:
    build_wheel(TEXTS, tmp_path, tmp_path / "cache" / WHEEL, progress)
    assert sorted(builder.order) == sorted(TEXTS)
    assert builder.order.index("large_msgs") < builder.order.index("small_msgs")
    assert builder.most <= 2


def test_steps_of_building_are_those_that_are_expected(
    builder: Builder, progress: Progress, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    progress.plan(expected_steps(TEXTS, tmp_path / WHEEL))
    build_wheel(TEXTS, tmp_path, tmp_path / "cache" / WHEEL, progress)
    assert progress.estimate() == (1.0, 0.0)


def test_wheel_has_modules_libraries_and_definitions(builder: Builder, progress: Progress, tmp_path: Path) -> None:
    wheel = wheel_path(COMMON, "jazzy", TEXTS, {"XDG_CACHE_HOME": str(tmp_path)})
    build_wheel(TEXTS, tmp_path, wheel, progress)
    archive = zipfile.ZipFile(wheel)
    inside = archive.namelist()
    stem = "-".join(wheel.name.split("-")[:2])
    data, share = f"{stem}.data/data", f"{stem}.data/data/share"
    assert {name for name in inside if "large_msgs" in name} == {
        "large_msgs/__init__.py",
        "large_msgs/msg/__init__.py",
        "large_msgs/large_msgs_s__rosidl_typesupport_c.so",
        f"{data}/lib/liblarge_msgs__rosidl_typesupport_fastrtps_c.so",
        f"{data}/lib/liblarge_msgs__rosidl_typesupport_introspection_c.so",
        *(
            f"{share}/large_msgs/msg/{name}.{kind}"
            for name in ("Two", "Three", "Four")
            for kind in ("msg", "idl", "json")
        ),
        f"{share}/large_msgs/package.xml",
        f"{share}/ament_index/resource_index/packages/large_msgs",
        f"{share}/ament_index/resource_index/rosidl_interfaces/large_msgs",
    }
    assert f"{data}/lib/lib{COMMON}.so" in inside
    listed = archive.read(f"{share}/ament_index/resource_index/rosidl_interfaces/small_msgs").decode()
    assert listed.splitlines() == ["msg/One.idl", "msg/One.msg"]
    record = list(csv.reader(archive.read(f"{stem}.dist-info/RECORD").decode().splitlines()))
    assert [row[0] for row in record] == inside
    assert all(int(size) == archive.getinfo(name).file_size for name, _, size in record[:-1])
    first = wheel.read_bytes()
    build_wheel(TEXTS, tmp_path, wheel, progress)
    assert wheel.read_bytes() == first


def test_pip_installs_wheel_into_environment(builder: Builder, progress: Progress, tmp_path: Path) -> None:
    wheel = wheel_path(COMMON, "jazzy", TEXTS, {"XDG_CACHE_HOME": str(tmp_path)})
    build_wheel(TEXTS, tmp_path, wheel, progress)
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", str(tmp_path / "venv")], check=True, timeout=TIMEOUT)
    pip = [sys.executable, "-m", "pip", "--python", str(tmp_path / "venv" / "bin" / "python"), "install", "--quiet"]
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    subprocess.run([*pip, "--no-deps", str(wheel)], check=True, timeout=TIMEOUT, env=environment)
    assert (tmp_path / "venv" / "lib" / "libcellwright_ros2_interfaces.so").is_file()
    assert list((tmp_path / "venv").glob("lib/python*/site-packages/small_msgs/__init__.py"))


def test_failed_compiler_leaves_no_wheel_and_links_nothing(
    builder: Builder, progress: Progress, tmp_path: Path
) -> None:
    builder.bad = "interfaces: types.c of a"
    wheel = tmp_path / "cache" / WHEEL
    with pytest.raises(UsageError, match=r"types\.c of a: g\+\+ failed:\nno such type"):
        build_wheel(TEXTS, tmp_path, wheel, progress)
    assert list(wheel.parent.iterdir()) == []
    assert "interfaces: library" not in builder.ran


def test_missing_tools_are_named_before_anything_is_built(
    tmp_path: Path, progress: Progress, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CXX", raising=False)
    monkeypatch.setattr(build, "run", lambda *_: pytest.fail("a program was started"))
    assert missing_tools()[:1] == ["g++"]
    with pytest.raises(MissingToolsError, match=r"building the interfaces requires g\+\+"):
        build_wheel(TEXTS, tmp_path, tmp_path / "cache" / "wheel.whl", progress)
    assert not (tmp_path / "cache").exists()
