"""Another checkout, and programs with its modules."""

from pathlib import Path

import pytest

from benchmarks.checkout import OURS, Checkout
from cellwright.util.errors import UsageError


@pytest.fixture
def other(tmp_path: Path) -> Checkout:
    """A checkout with a package of each name."""
    for name, text in {"src/cellwright/__init__.py": "NAME = 'other'", "benchmarks/trial.py": ""}.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True)
        path.write_text(text, encoding="utf-8")
    (tmp_path / "benchmarks" / "__init__.py").touch()
    return Checkout(tmp_path)


def test_program_loads_modules_of_checkout(other: Checkout) -> None:
    program = "import json; print(json.dumps([cellwright.NAME, sys.argv[1:]]))"
    assert other.run(program, "500") == ["other", ["500"]]


def test_failed_program_is_reported_with_output(other: Checkout) -> None:
    with pytest.raises(UsageError, match="a timed process failed: no luck"):
        other.run("sys.exit('no luck')")


def test_modules_from_elsewhere_are_refused(other: Checkout) -> None:
    (other.folder / "benchmarks" / "__init__.py").unlink()
    (other.folder / "benchmarks" / "trial.py").unlink()
    (other.folder / "benchmarks").rmdir()
    (other.folder / "benchmarks").symlink_to(OURS / "benchmarks")
    with pytest.raises(UsageError, match="benchmarks is loaded from"):
        other.run("print(1)")


def test_commit_without_git_is_empty(other: Checkout) -> None:
    assert other.commit == ""


def test_folder_without_sources_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"src/cellwright/__init__\.py is missing; give the folder of a checkout"):
        Checkout(tmp_path)
