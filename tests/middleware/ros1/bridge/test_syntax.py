"""Code for the python3 of ROS 1 must be Python 3.8, and must need no other part of Cellwright."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import cellwright
from tests.support.waiting import TIMEOUT

PACKAGE = Path(cellwright.__file__).parent
FILES = sorted(
    path for room in ("middleware/wire", "middleware/ros1/bridge") for path in (PACKAGE / room).rglob("*.py")
)
NEWER = {"removeprefix", "removesuffix", "cache", "bit_count", "pairwise", "batched"}


def test_syntax_check_finds_files() -> None:
    assert len(FILES) > 10


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(PACKAGE)))
def test_bridge_file_parses_with_python_3_8(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"), feature_version=(3, 8))
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute):
            assert node.attr not in NEWER
        if isinstance(node, ast.ImportFrom) and node.module != "__future__":
            assert not {alias.name for alias in node.names} & NEWER
        if isinstance(node, ast.With):  # only newer versions accept parentheses
            assert "with (" not in ast.unparse(node).splitlines()[0]


def test_link_is_imported_with_standard_library_only() -> None:
    program = (
        "import sys, types; package = types.ModuleType('cellwright'); package.__path__ = [sys.argv[1]]; "
        "sys.modules['cellwright'] = package; import cellwright.middleware.wire.frames"
    )
    subprocess.run([sys.executable, "-I", "-S", "-c", program, str(PACKAGE)], check=True, timeout=TIMEOUT)
