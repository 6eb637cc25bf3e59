"""Code for the Python of ROS 2 must be Python 3.10, and must need no other part of Cellwright, nor of Python."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import cellwright
from tests.support.waiting import TIMEOUT

PACKAGE = Path(cellwright.__file__).parent
FILES = sorted((PACKAGE / "middleware" / "ros2" / "bridge").glob("*.py"))
NEWER = {"StrEnum", "Self", "tomllib", "TaskGroup", "ExceptionGroup", "batched", "override"}
"""Names that came after Python 3.10."""

STUB = """
import importlib.abc, importlib.machinery, sys, types

class Anything:
    def __init__(self, *_, **__): pass
    def __getattr__(self, name): return Anything()

class Module(types.ModuleType):
    __path__ = []
    def __getattr__(self, name):
        if name.startswith("__"): raise AttributeError(name)
        return type(name, (Exception if name.endswith("Exception") else Anything,), {})

class Finder(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    def find_spec(self, name, path, target=None):
        if name.partition(".")[0] in ("rclpy", "std_msgs", "rcl_interfaces", "rosidl_parser"):
            return importlib.machinery.ModuleSpec(name, self, is_package=True)
    def create_module(self, spec): return Module(spec.name)
    def exec_module(self, module): pass

sys.meta_path.insert(0, Finder())
package = types.ModuleType("cellwright"); package.__path__ = [sys.argv[1]]; sys.modules["cellwright"] = package
import cellwright.middleware.ros2.bridge.bridge, cellwright.middleware.ros2.bridge.relay
assert not {"numpy", "rosbags", "cellwright.util"} & set(sys.modules), sorted(sys.modules)
"""
"""Loads bridge and relay with the standard library and a stand-in of rclpy."""


def test_syntax_check_finds_files() -> None:
    assert {"bridge.py", "relay.py", "topics.py"} <= {path.name for path in FILES}


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_bridge_file_parses_with_python_3_10(path: Path) -> None:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 10))):
        assert not isinstance(node, ast.TryStar)
        if isinstance(node, ast.Attribute):
            assert node.attr not in NEWER
        if isinstance(node, ast.ImportFrom) and node.module != "__future__":
            assert not {alias.name for alias in node.names} & NEWER


def test_bridge_and_relay_are_loaded_with_standard_library_and_rclpy_only() -> None:
    subprocess.run([sys.executable, "-I", "-S", "-c", STUB, str(PACKAGE)], check=True, timeout=TIMEOUT)
