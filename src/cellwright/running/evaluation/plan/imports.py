"""Python files that a program is made of: those that it imports, found without running it."""

import ast
from collections.abc import Iterable, Sequence
from pathlib import Path

_DYNAMIC = frozenset(
    ("__import__", "exec", "exec_module", "import_module", "load_module", "run_module", "run_path", "walk_packages")
)
"""Functions that import what their source does not name."""


def imported_files(first: Iterable[Path], folders: Sequence[Path], package: str = "") -> set[Path] | None:
    """Return these files and all that they import from the folders, directly or not.

    Args:
        first: files to begin with.
        folders: folders in which modules are searched, in this order.
        package: name of the only package that counts; empty for everything in the folders.

    Returns:
        None if a file imports modules by names that it computes, or from other folders (`sys.path`).
    """
    found: set[Path] = set()
    waiting = list(first)
    while waiting:
        file = waiting.pop()
        if file in found or not file.is_file():
            continue
        found.add(file)
        try:
            nodes = list(ast.walk(ast.parse(file.read_bytes())))
        except (SyntaxError, ValueError, RecursionError, MemoryError):
            continue  # its import fails, and imports nothing
        if any(map(_is_dynamic, nodes)):
            return None
        for node in nodes:
            waiting += _imports(node, file, folders, package)
    return found


def module_files(name: str, folders: Iterable[Path]) -> list[Path]:
    """Return the files that an import of a module runs: its packages' and its own; empty if no folder has it.

    A name in a module counts as well: `from tools.grip import close` runs what `import tools.grip` does.
    """
    for folder in folders:
        files, place = [], folder
        for part in name.split("."):
            package, module, place = place / part / "__init__.py", place / f"{part}.py", place / part
            if package.is_file():
                files.append(package)
            elif module.is_file():
                files.append(module)
                break
            elif not place.is_dir():
                break
        if files:
            return files
    return []


def _imports(node: ast.AST, file: Path, folders: Sequence[Path], package: str) -> list[Path]:
    match node:
        case ast.Import(names):
            places, modules = folders, [each.name for each in names]
        case ast.ImportFrom(module, names, level) if level and level > len(file.parents):
            return []
        case ast.ImportFrom(module, names, level):
            places = [file.parents[level - 1]] if level else folders
            modules = [f"{module}.{each.name}" if module else each.name for each in names]
        case _:
            return []
    if package and places is folders:
        modules = [name for name in modules if name.partition(".")[0] == package]
    files = [found for name in modules for found in module_files(name, places)]
    # a package may list its modules in __all__
    if any(name.endswith(".*") for name in modules):
        files += [each for found in files if found.name == "__init__.py" for each in found.parent.glob("*.py")]
    return files


def _is_dynamic(node: ast.AST) -> bool:
    match node:
        case ast.Name(name) | ast.alias(name):
            return name in _DYNAMIC
        case ast.Attribute(ast.Name("sys"), "path"):
            return True
        case ast.Attribute(_, name):
            # a method of this name is another one
            return name in _DYNAMIC - {"exec"}
        case _:
            return False
