"""Tests of the root package: it has the names that a newcomer needs, and costs nothing until they are used."""

import ast
import importlib
import subprocess
import sys
from pathlib import Path

import pytest

import cellwright
from tests.support.waiting import TIMEOUT

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


def test_unknown_module_is_not_found() -> None:
    with pytest.raises(ModuleNotFoundError, match="clientele"):
        importlib.import_module("cellwright.clientele")
