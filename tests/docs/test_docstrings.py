"""Examples in docstrings: they run, and each public class has one."""

import doctest
import importlib
import inspect
import warnings
from pathlib import Path
from typing import Any

import pytest

import cellwright

SOURCE = Path(cellwright.__file__).parent
OPTIONS = doctest.NORMALIZE_WHITESPACE | doctest.ELLIPSIS
WITHOUT_EXAMPLE = {"CellwrightError", "DescriptionWarning"}
"""Public classes that a program catches or filters, and never uses otherwise."""


def modules_with_examples() -> list[str]:
    files = [file for file in SOURCE.rglob("*.py") if ">>>" in file.read_text() and "data" not in file.parts]
    return sorted(".".join(file.relative_to(SOURCE.parent).with_suffix("").parts) for file in files)


def public_classes() -> list[str]:
    names = [name for name in cellwright.__all__ if inspect.isclass(getattr(cellwright, name))]
    return sorted(set(names) - WITHOUT_EXAMPLE)


@pytest.mark.parametrize("name", modules_with_examples())
def test_examples_of_module_run_as_shown(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    module = importlib.import_module(name.removesuffix(".__init__"))
    with warnings.catch_warnings():
        warnings.simplefilter("error", DeprecationWarning)
        result = doctest.testmod(module, optionflags=OPTIONS)
    assert result.attempted > 0
    assert result.failed == 0


@pytest.mark.parametrize("name", public_classes())
def test_public_class_has_an_example_that_runs(name: str) -> None:
    public: Any = getattr(cellwright, name)
    examples = doctest.DocTestFinder(recurse=False).find(public, name)
    assert any(each.examples for each in examples), f"{name}: add an Example section with >>> lines to its docstring"
