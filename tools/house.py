"""House check: the order inside files, names in backticks, mirrored tests, and the size of files and functions.

`python -m tools.house` prints each finding as `path:line: what is wrong; what to do` and exits with 1 if there are any.
`python -m tools.house --counts [ROOT]` prints figures of this or another checkout instead.
"""

import argparse
import ast
import io
import re
import sys
import tokenize
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

ROOT = Path(__file__).parents[1]

MAX_LINES, MAX_FUNCTION_LINES, MAX_PARAMETERS = 400, 60, 7
"""Largest file; largest function in lines of code, without its docstring; most parameters, besides `self`."""

SOURCES = ("src", "tools", "benchmarks", "kitting", "fuzz")
SKIPPED = ("src/cellwright/middleware/ros1/packages/data",)
"""Programs of others' form: the packages of 2017."""

ELSEWHERE = {
    "middleware/ros1/bridge": "ros1",
    "middleware/ros2/bridge": "ros2",
    "middleware/wire/relay": "ros1",
    "middleware/ros2/packages/generate": "middleware/ros2/packages",
}
"""Rooms and modules that only an interpreter of ROS loads, with the folders of tests that run them there."""

LIMITED = (*SOURCES, "tests", "examples", "adapters", "docs", "scripts")
"""Folders whose Python files have at most `MAX_LINES` lines."""

GENERATED = "\n\nGenerated: "
"""Text in the docstring of a module that a tool writes, whose tests compare it with what the tool writes today."""

WORDS = (
    "src",
    "tools",
    "benchmarks",
    "kitting",
    "fuzz",
    "tests",
    "examples",
    "docs",
    "scripts",
    ".ci",
    "Makefile",
    "pyproject.toml",
)
"""Places whose words a name in backticks may be of."""

FOREIGN = frozenset({"ros_control", "MjsBody", "MjsGeom", "u32"})
"""Words of other projects, which ours name and do not use."""

PAGES = ("CONTRIBUTING.md", "docs/design.md", "tests/support/README.md")
"""Pages that say what is where: each path in backticks must exist, in the project or in the package."""

Function = ast.FunctionDef | ast.AsyncFunctionDef

_DEFINITIONS = (ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
_QUOTED = re.compile(r"``?([^`\n]+)``?")
_NAME = re.compile(r"(?!\w+_T_)_*[A-Za-z]\w*(\.\w+)*(\(\))?")  # not a transform: `world_T_tray`
_PATH = re.compile(r"(?!build/|cellwright/)[a-z_][\w-]*(/[\w.-]+)+|\w+\.py")  # not what is built, and no topic
_PLACEHOLDER = re.compile(r"[A-Z]{2,}")
_WORD = re.compile(r"\w+")


@dataclass(frozen=True)
class Finding:
    """One place where a file breaks a rule."""

    path: str
    line: int
    text: str

    def __str__(self) -> str:
        """The finding as `path:line: text`."""
        return f"{self.path}:{self.line}: {self.text}"


@dataclass(frozen=True)
class Module:
    """A Python file of the project.

    Attributes:
        path: its path in the project, with slashes.
        source: its text.
    """

    path: str
    source: str

    @cached_property
    def tree(self) -> ast.Module:
        """Its syntax tree."""
        return ast.parse(self.source)

    @cached_property
    def code_lines(self) -> frozenset[int]:
        """Numbers of the lines with code: without blank lines, comments and docstrings."""
        skipped = (
            tokenize.COMMENT,
            tokenize.NL,
            tokenize.NEWLINE,
            tokenize.INDENT,
            tokenize.DEDENT,
            tokenize.ENDMARKER,
        )
        lines: set[int] = set()
        for token in tokenize.generate_tokens(io.StringIO(self.source).readline):
            if token.type not in skipped:
                lines.update(range(token.start[0], token.end[0] + 1))
        for node in ast.walk(self.tree):
            if (
                isinstance(node, ast.Expr)
                and isinstance(node.value, ast.Constant)
                and isinstance(node.value.value, str)
            ):
                lines.difference_update(range(node.lineno, (node.end_lineno or node.lineno) + 1))
        return frozenset(lines)


@dataclass(frozen=True)
class Project:
    """The files of a checkout.

    Attributes:
        root: its folder.
    """

    root: Path

    @cached_property
    def modules(self) -> list[Module]:
        """Its Python files without tests and docs, in order."""
        paths = sorted(path for folder in SOURCES for path in (self.root / folder).rglob("*.py"))
        named = [(path.relative_to(self.root).as_posix(), path) for path in paths]
        return [Module(name, path.read_text(encoding="utf-8")) for name, path in named if not name.startswith(SKIPPED)]

    @cached_property
    def words(self) -> frozenset[str]:
        """Words of its code, data and scripts: without those in docstrings, comments and pages."""
        found: set[str] = set()
        for path in (path for place in WORDS for path in [self.root / place, *sorted((self.root / place).rglob("*"))]):
            if not path.is_file() or path.suffix in (".md", ".svg", ".png", ".pyc"):
                continue
            found.update(_WORD.findall(path.as_posix().removeprefix(self.root.as_posix())))
            try:
                text = path.read_text(encoding="utf-8")
            except UnicodeDecodeError:
                continue
            found.update(_WORD.findall(_without_prose(text) if path.suffix == ".py" else text))
        return FOREIGN.union(found)

    @cached_property
    def unmirrored(self) -> list[str]:
        """Modules of the package without a mirrored test."""
        return [
            module.path for module in self.modules if module.path.startswith("src/") and not self._is_mirrored(module)
        ]

    def _is_mirrored(self, module: Module) -> bool:
        """Return whether a test of the module is where the mirror says, or beside that place and imports the module."""
        inside = Path(module.path).relative_to("src/cellwright").with_suffix("")
        if inside.name in ("__init__", "__main__") or not module.code_lines or "data" in inside.parts:
            return True
        if GENERATED in (ast.get_docstring(module.tree) or ""):
            return True
        if (elsewhere := ELSEWHERE.get(inside.parent.as_posix()) or ELSEWHERE.get(inside.as_posix())) is not None:
            return any((self.root / "tests" / elsewhere).glob("test_*.py"))
        tests, name = self.root / "tests" / inside.parent, inside.name.strip("_")
        if (tests / f"test_{name}.py").exists() or any((tests / name).glob("test_*.py")):
            return True
        dotted = re.escape(".".join(["cellwright", *inside.parent.parts]))
        imported = re.compile(rf"(from|import) {dotted}\.{inside.name}\b|from {dotted} import [^\n]*\b{inside.name}\b")
        return any(imported.search(path.read_text(encoding="utf-8")) for path in tests.glob("test_*.py"))


def check(project: Project) -> Iterator[Finding]:
    """Yield the findings of a checkout."""
    yield from long_files(project)
    for module in project.modules:
        yield from late_constants(module)
        yield from stale_names(module, project.words)
    yield from stale_paths(project)
    for path in project.unmirrored:
        folder, _, name = path.replace("src/cellwright", "tests").rpartition("/")
        yield Finding(path, 1, f"no mirrored test; add {folder}/test_{name.lstrip('_')}")


def long_files(project: Project) -> Iterator[Finding]:
    """Yield the Python files with too many lines, those of tests included."""
    for path in sorted(path for folder in LIMITED for path in (project.root / folder).rglob("*.py")):
        if (lines := len(path.read_text(encoding="utf-8").splitlines())) > MAX_LINES:
            name = path.relative_to(project.root).as_posix()
            yield Finding(name, 1, f"{lines} lines (at most {MAX_LINES}); split it where its idea changes")


def late_constants(module: Module) -> Iterator[Finding]:
    """Yield the constants that stand behind a definition which they do not need."""
    body = module.tree.body
    first = next((number for number, node in enumerate(body) if isinstance(node, _DEFINITIONS)), len(body))
    behind: set[str] = set()
    for node in body[first:]:
        names = _constants(node)
        if names and isinstance(node, ast.Assign | ast.AnnAssign):
            if node.value is None or not _needed(node.value) & behind:
                advice = "a constant behind the first definition; put it before"
                yield Finding(module.path, node.lineno, f"{names[0]}: {advice}")
            else:
                behind.update(names)
        elif isinstance(node, _DEFINITIONS):
            behind.add(node.name)
        else:
            behind.update(each.id for each in ast.walk(node) if isinstance(each, ast.Name))


def stale_names(module: Module, words: frozenset[str]) -> Iterator[Finding]:
    """Yield the names in backticks, in docstrings and comments, of which no code has the words."""
    for line, text in _prose(module.source):
        for offset, part in enumerate(text.splitlines()):
            for name in _QUOTED.findall(part):
                if _NAME.fullmatch(name) and (missing := [word for word in _WORD.findall(name) if word not in words]):
                    advice = f"`{name}`: no code has {missing[0]!r}; write the name of today"
                    yield Finding(module.path, line + offset, advice)


def stale_paths(project: Project) -> Iterator[Finding]:
    """Yield the paths in backticks on the pages for contributors that do not exist. NAME stands for any name."""
    for page in (page for page in PAGES if (project.root / page).exists()):
        for number, line in enumerate((project.root / page).read_text(encoding="utf-8").splitlines(), start=1):
            for path in filter(_PATH.fullmatch, _QUOTED.findall(line)):
                pattern = _PLACEHOLDER.sub("*", path)
                places = ("", "src/cellwright/") if "/" in path else ("**/",)
                if not any(next(project.root.glob(place + pattern), None) for place in places):
                    yield Finding(page, number, f"`{path}`: no such file or folder; write the path of today")


def large_functions(module: Module, size: Callable[[Module, Function], int], most: int) -> list[str]:
    """Return the functions of a module whose size is over a bound, as `path:line name: size`."""
    functions = [node for node in ast.walk(module.tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    sizes = [(node, size(module, node)) for node in functions]
    return [f"{module.path}:{node.lineno} {node.name}: {number}" for node, number in sizes if number > most]


def figures(project: Project) -> Iterator[str]:
    """Yield the figures of a checkout, a line each; large functions are named below their count."""
    package = [module for module in project.modules if module.path.startswith("src/")]
    lines = [line for module in package for line in module.source.splitlines()]
    code = sum(len(module.code_lines) for module in package)
    imports = sum(
        _lines_of_code(module, node)
        for module in package
        for node in ast.walk(module.tree)
        if isinstance(node, ast.Import | ast.ImportFrom)
    )
    comments = sum(line.lstrip().startswith("#") for line in lines)
    long = sum(len(module.source.splitlines()) > MAX_LINES for module in package)
    seams = [module for module in package if _has_seam(module)]
    yield f"src: {len(package)} files, {len(lines)} lines, {code} of code"
    yield f"files over {MAX_LINES} lines: {long}"
    movable = sum(any(late_constants(module)) for module in seams)
    yield f"files with constants behind a definition: {len(seams)}, movable {movable}"
    yield f"whole-line comments: {comments}, {100 * comments / len(lines):.2f} % of lines"
    yield f"imports: {100 * imports / code:.1f} % of code"
    yield f"modules without a mirrored test: {len(project.unmirrored)}"
    for about, size, most in (
        (f"functions over {MAX_FUNCTION_LINES} lines of code", _lines_of_code, MAX_FUNCTION_LINES),
        (f"functions over {MAX_PARAMETERS} parameters", _parameters, MAX_PARAMETERS),
    ):
        large = [each for module in package for each in large_functions(module, size, most)]
        yield f"{about}: {len(large)}"
        yield from (f"  {each}" for each in large)


def _lines_of_code(module: Module, node: ast.stmt) -> int:
    return len(module.code_lines & set(range(node.lineno, (node.end_lineno or node.lineno) + 1)))


def _parameters(_module: Module, node: Function) -> int:
    """Count the parameters besides `self`. Those of a command are its options, and do not count."""
    if any("command" in ast.unparse(each) for each in node.decorator_list):
        return 0
    named = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
    return len(named) - (bool(named) and named[0].arg in ("self", "cls"))


def _has_seam(module: Module) -> bool:
    body = module.tree.body
    first = next((number for number, node in enumerate(body) if isinstance(node, _DEFINITIONS)), len(body))
    return any(_constants(node) for node in body[first:])


def _constants(node: ast.stmt) -> list[str]:
    """Return the names of a statement that sets constants; empty for any other."""
    targets = node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
    names = [each.id for target in targets for each in ast.walk(target) if isinstance(each, ast.Name)]
    return names if names and all(name.strip("_").isupper() for name in names) else []


def _needed(node: ast.AST) -> set[str]:
    """Return the names that an expression reads when it is evaluated: not those in lambdas."""
    if isinstance(node, ast.Lambda):
        return set()
    names = {node.id} if isinstance(node, ast.Name) else set()
    return names.union(*map(_needed, ast.iter_child_nodes(node)))


def _prose(source: str) -> Iterator[tuple[int, str]]:
    """Yield the docstrings and comments of a file, with their first lines."""
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            yield node.lineno, node.value.value
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        if token.type == tokenize.COMMENT:
            yield token.start[0], token.string


def _without_prose(source: str) -> str:
    """Return a Python file without docstrings and comments."""
    lines = source.splitlines()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str):
            for number in range(node.lineno - 1, node.end_lineno or node.lineno):
                lines[number] = ""
    return "\n".join(re.sub(r"(^|\s)# .*", "", line) for line in lines)


def main() -> int:
    """Run the check over the project; the exit status."""
    parser = argparse.ArgumentParser(prog="python -m tools.house", description="Check the order of the house.")
    parser.add_argument("root", nargs="?", type=Path, default=ROOT, help="the checkout (default: this one)")
    parser.add_argument("--counts", action="store_true", help="print figures instead of findings")
    options = parser.parse_args()
    project = Project(options.root.resolve())
    found = list(figures(project) if options.counts else map(str, check(project)))
    sys.stdout.write("".join(f"{line}\n" for line in found))
    return int(bool(found) and not options.counts)


if __name__ == "__main__":
    sys.exit(main())
