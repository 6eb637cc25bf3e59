"""Tests of a program's imports: every file that Python would run is found, and no other."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.running.evaluation.plan.imports import imported_files, module_files

FILES = {
    "main.py": "",
    "plain.py": "from deep.inner import leaf",
    "names.py": "from plain import leaf\nfrom deep.inner.leaf import VALUE",
    "circle.py": "import main",
    "late.py": "def load():\n    import plain",
    "deep/inner/__init__.py": "from .. import sibling",
    "deep/inner/leaf.py": "VALUE = 1",
    "deep/__init__.py": "",
    "deep/sibling.py": "from .inner.leaf import VALUE",
    "listed/__init__.py": "__all__ = ['one']",
    "listed/one.py": "",
    "space/inside.py": "import json",
    "broken.py": "def (:",
    "unused.py": "",
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name, text in FILES.items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_text(text)
    return tmp_path


DEEP = {"deep/__init__.py", "deep/inner/__init__.py", "deep/sibling.py", "deep/inner/leaf.py"}


@pytest.mark.parametrize(
    ("text", "files"),
    [
        ("import json, numpy, no_such_module", set()),
        ("import plain", {"plain.py", *DEEP}),
        ("import deep.inner.leaf as x", DEEP),
        ("from deep import sibling", DEEP),
        ("import names", {"names.py", "plain.py", *DEEP}),
        ("import circle", {"circle.py"}),
        ("if True:\n    import late", {"late.py", "plain.py", *DEEP}),
        ("from listed import *", {"listed/__init__.py", "listed/one.py"}),
        ("import listed", {"listed/__init__.py"}),
        ("import space.inside", {"space/inside.py"}),
        ("from space import inside, nothing", {"space/inside.py"}),
        ("from ..... import x\nfrom . import plain", {"plain.py", *DEEP}),
        ("import broken", {"broken.py"}),
        ("import", set()),
        ("model.eval()\nimport broken", {"broken.py"}),
    ],
)
def test_imported_files_are_those_that_the_source_names(folder: Path, text: str, files: set[str]) -> None:
    main = folder / "main.py"
    main.write_text(text)
    found = imported_files([main], [folder])
    assert found == {main, *(folder / file for file in files)}


@pytest.mark.parametrize(
    "text",
    [
        "__import__('plain')",
        "from importlib import import_module",
        "import importlib\nimportlib.import_module(x)",
        "exec(code)",
        "import runpy\nrunpy.run_path('plain.py')",
        "spec.loader.exec_module(module)",
        "import sys\nsys.path.insert(0, 'lib')",
    ],
)
def test_computed_imports_are_not_known(folder: Path, text: str) -> None:
    (folder / "plain.py").write_text(text)
    (folder / "main.py").write_text("import plain")
    assert imported_files([folder / "main.py"], [folder]) is None


def test_only_the_named_package_counts(folder: Path) -> None:
    main = folder / "main.py"
    main.write_text("import plain, listed")
    assert imported_files([main], [folder], "listed") == {main, folder / "listed" / "__init__.py"}


def test_module_files_are_searched_in_the_order_of_folders(folder: Path) -> None:
    other = folder / "other"
    other.mkdir()
    (other / "plain.py").write_text("")
    assert module_files("plain", [other, folder]) == [other / "plain.py"]
    assert module_files("late", [other, folder]) == [folder / "late.py"]
    assert module_files("missing", [other, folder]) == []


NAMES = ("a", "b", "c", "d")


@pytest.mark.slow
@given(edges=st.sets(st.tuples(st.sampled_from(NAMES), st.sampled_from(NAMES)), max_size=8))
def test_files_are_those_that_the_graph_of_imports_reaches(
    edges: set[tuple[str, str]], tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("graph")
    for name in NAMES:
        (folder / f"{name}.py").write_text("".join(f"import {end}\n" for start, end in sorted(edges) if start == name))
    found = imported_files([folder / "a.py"], [folder]) or set()
    reached = {"a"}
    for _ in NAMES:
        reached |= {end for start, end in edges if start in reached}
    assert {file.stem for file in found} == reached


@pytest.mark.slow
def test_files_of_packages_are_those_that_python_loads(folder: Path) -> None:
    main = folder / "main.py"
    main.write_text("import names, listed, space.inside\nfrom listed import *\n")
    code = "import sys, main; print(*(getattr(each, '__file__', '') for each in sys.modules.values()), sep='\\n')"
    ran = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    loaded = {Path(line) for line in ran.stdout.splitlines() if line.startswith(str(folder))}
    assert imported_files([main], [folder]) == loaded
