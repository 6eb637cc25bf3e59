"""Tests of the root package: it has the names that a newcomer needs, and costs nothing until they are used."""

import ast
import importlib
import subprocess
import sys
import warnings
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import cellwright
from tests.waiting import TIMEOUT

SOURCE = Path(cellwright.__file__)
PUBLIC = [name for name in cellwright.__all__ if name != "__version__"]


def run(program: str) -> str:
    path = str(SOURCE.parents[1])
    command = [sys.executable, "-S", "-E", "-c", f"import sys; sys.path.insert(0, {path!r})\n{program}"]
    return subprocess.run(command, capture_output=True, text=True, check=True, timeout=TIMEOUT).stdout


def test_import_loads_nothing_before_first_use() -> None:
    loaded = run("import cellwright; print(*(name for name in sys.modules if name.startswith('cellwright.')))")
    assert loaded == "cellwright._package\n"


def test_names_without_dependencies_load_in_bare_interpreter() -> None:
    program = "import cellwright; print(cellwright.AssembledRobot.__name__, cellwright.errors.__name__)\n"
    program += "print(*(name for name in ('numpy', 'mujoco', 'yaml', 'rosbags') if name in sys.modules))"
    assert run(program) == "AssembledRobot cellwright.util.errors\n\n"


@pytest.mark.parametrize("name", PUBLIC)
def test_public_names_exist_with_docs_and_types(name: str) -> None:
    found = getattr(cellwright, name)
    assert found.__doc__
    assert name in dir(cellwright)
    tree = ast.parse(SOURCE.read_text())
    imported = {alias.asname for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert name in imported


def test_type_checkers_see_same_names() -> None:
    tree = ast.parse(SOURCE.read_text())
    imported = {alias.asname for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert imported - {None} == set(PUBLIC)


def test_unknown_name_is_refused() -> None:
    with pytest.raises(AttributeError, match="no attribute 'Robot'"):
        getattr(cellwright, "Robot")  # noqa: B009


@pytest.mark.parametrize(("old", "new"), cellwright._MOVED.items())
def test_old_module_names_of_version_0_1_work(old: str, new: str) -> None:
    before = set(sys.modules)
    with warnings.catch_warnings(record=True) as warned:
        warnings.simplefilter("always")
        found = importlib.import_module(f"cellwright.{old}")
    assert f"cellwright.{old} is deprecated; use cellwright.{new}" in [str(each.message) for each in warned]
    assert found is importlib.import_module(f"cellwright.{new}")
    for name in set(sys.modules) - before:
        if sys.modules[name].__name__ != name:
            del sys.modules[name]


def test_unknown_module_is_not_found() -> None:
    with pytest.raises(ModuleNotFoundError, match="clientele"):
        importlib.import_module("cellwright.clientele")


@pytest.mark.parametrize(
    ("module", "old", "new"),
    [
        ("cellwright", "OpenedRecording", "Recording"),
        ("cellwright.middleware.interface.table", "says", "publishes"),
        ("cellwright.middleware.interface.table", "Where", "Availability"),
        ("cellwright.recording.replay.opened", "OpenedRecording", "Recording"),
        ("cellwright.rendering.scene.scene", "Frame", "SceneFrame"),
        ("cellwright.clients.client.client:Client", "intend", "set_status"),
    ],
)
def test_former_name_gives_the_present_object_with_a_warning(module: str, old: str, new: str) -> None:
    owner: Any = importlib.import_module(module.partition(":")[0])
    if ":" in module:
        calls: list[str] = []
        client: Any = SimpleNamespace(**{new: calls.append})
        with pytest.warns(DeprecationWarning, match=rf"{old} is deprecated; use .*\b{new}"):
            getattr(owner.Client, old)(client, "fetching")
        assert calls == ["fetching"]
        return
    with pytest.warns(DeprecationWarning, match=rf"{old} is deprecated; use .*\b{new}"):
        found = getattr(owner, old)
    assert found is getattr(owner, new)
    with pytest.raises(AttributeError, match="'nonsense'"):
        owner.nonsense  # noqa: B018
