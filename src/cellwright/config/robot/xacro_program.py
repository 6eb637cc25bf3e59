"""Process that expands a xacro file within bounds of memory, with expressions restricted to arithmetic.

xacro evaluates expressions as Python without its built-in functions, which is no barrier: attributes of any value lead
to everything that is loaded. So this program refuses attributes that lead inwards, and removes functions that open such
a path. The bounds of the process limit the cost of an expression.

A xacro file is a program. It runs in its own process, with bounds of memory and time, so that one that never ends or
grows without limit does no harm.
"""

import ast
import contextlib
import io
import json
import re
import sys
from pathlib import Path
from typing import Any
from xml.parsers.expat import ExpatError

import xacro
import xacro.substitution_args

from cellwright.config.parsing.tree import Problem, Problems, shortened
from cellwright.config.robot.urdf_file import cleaned_text, package_folders
from cellwright.util.errors import DescriptionError, suggestion
from cellwright.util.files import open_to_read

_INTERNAL_ATTRIBUTES = frozenset(
    {
        *("format", "format_map", "mro"),  # a format can name attributes, too
        *("gi_frame", "gi_code", "gi_yieldfrom", "cr_frame", "cr_code", "cr_await", "cr_origin"),
        *("ag_frame", "ag_code", "ag_await", "f_back", "f_builtins", "f_code", "f_globals", "f_locals"),
        *("tb_frame", "tb_next", "co_code", "co_consts", "co_names"),
    }
)
_REMOVED_FUNCTIONS = ("type", "vars")
MAX_MEMORY = 1 << 30
"""Maximum memory for the expansion of a file [bytes]; enforced on Linux only."""
MAX_TEXT = 16 << 20
"""Maximum length of an expanded text, in characters."""
_UNDEFINED = re.compile(r"Undefined substitution argument (\S+)")
_QUOTED = re.compile(r"'([^']+)'|\"([^\"]+)\"|(xacro:\w+)|'?(\w+)'?")
_MAX_MESSAGE_LENGTH = 300
_REPETITIONS = (  # xacro repeats a message and its source
    (re.compile(r"<class '[^']*'>: (.*) \1"), r"\1"),
    (re.compile(r"(: \S+) \[Errno \d+\].*"), r"\1"),
)
_parse = xacro.parse


def restrict_to_arithmetic() -> None:
    """Restrict xacro's expressions, in this process, to arithmetic."""
    xacro.safe_eval = _evaluate
    xacro.substitution_args._eval = _evaluate_substitution
    for name in _REMOVED_FUNCTIONS:
        xacro._global_symbols["python"].pop(name, None)


def check_expression(expression: str) -> None:
    """Refuse an expression that accesses Python's internals.

    Raises:
        XacroException: it does; the text names the access.
        SyntaxError: it is no expression.
    """
    for node in ast.walk(ast.parse(expression, "<expression>", "eval")):
        name = node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""
        is_inner = name.startswith("_") if isinstance(node, ast.Attribute) else name.startswith("__")
        if is_inner or (isinstance(node, ast.Attribute) and name in _INTERNAL_ATTRIBUTES):
            raise xacro.XacroException(f"an expression must not use {name!r}")


def _evaluate(expression: str, names: dict[str, Any], others: Any = None) -> Any:
    """Evaluate the expression in `${…}`."""
    text = expression.strip()
    check_expression(text)
    names.update(__builtins__={})
    return eval(text, names, others)  # noqa: S307


def _evaluate_substitution(text: str, context: dict[str, Any]) -> str:
    """Evaluate the expression in `$(eval …)`."""
    text = text.strip()
    check_expression(text)
    module = xacro.substitution_args
    arguments = context.setdefault("arg", {})
    known = {
        **module._eval_dict,
        "arg": lambda name: module.convert_value(module._eval_arg(name, args=arguments), "auto"),
        "dirname": lambda: module._eval_dirname(context["filename"]),
    }
    builtins = module._eval_dict["__builtins__"]
    return str(eval(text, {"__builtins__": builtins}, module._DictWrapper(arguments, known)))  # noqa: S307


class _ExpansionError(Exception):
    """File that does not expand, with its path, line (0: unknown) and reason."""

    def __init__(self, path: Path, line: int, message: str) -> None:
        super().__init__(message)
        self.path = path
        self.line = line


def main() -> None:
    """Expand the text on stdin of the file that the first argument names, with the arguments in the second (JSON)."""
    if sys.platform == "linux":
        import resource  # Windows has no such module

        resource.setrlimit(resource.RLIMIT_DATA, (MAX_MEMORY, MAX_MEMORY))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    output, path = sys.stdout, Path(sys.argv[1])
    text = sys.stdin.buffer.read().decode("utf-8", "replace")
    try:
        expanded = _expanded(path, text, json.loads(sys.argv[2]))
        answer: dict[str, Any] = {"text": expanded, "files": [str(each) for each in xacro.all_includes]}
    except _ExpansionError as error:
        answer = {"path": str(error.path), "line": error.line, "message": str(error)}
    print(json.dumps(answer), end="", file=output, flush=True)


class _Arguments(dict[str, str]):
    """Arguments of a file that note which names the file asks for."""

    def __init__(self, given: dict[str, str]) -> None:
        super().__init__(given)
        self.given = tuple(given)
        self.asked: dict[str, None] = {}

    def __contains__(self, name: object) -> bool:  # <xacro:arg name="…"/>
        self.asked[str(name)] = None
        return super().__contains__(name)

    def __getitem__(self, name: str) -> str:  # $(arg …)
        self.asked[name] = None
        return super().__getitem__(name)


def _expanded(path: Path, text: str, given: dict[str, str]) -> str:
    sink, arguments = io.StringIO(), _Arguments(given)
    try:
        with contextlib.redirect_stderr(sink), contextlib.redirect_stdout(sink):
            restrict_to_arithmetic()
            _find_packages_beside(path)
            xacro.init_stacks(str(path))
            document = xacro.parse(text, str(path))
            macros = [each.getAttribute("name") for each in document.getElementsByTagName("xacro:macro")]
            xacro.parse = _parsed_include
            xacro.process_doc(document, arguments)
            expanded = str(document.toxml())
            has_links = bool(document.getElementsByTagName("link"))
    except DescriptionError as error:
        problem = error.problems[0]
        assert isinstance(problem, Problem)
        raise _ExpansionError(Path(problem.path), problem.line, problem.message) from None
    except ExpatError as error:
        raise _ExpansionError(_current(path), error.lineno, f"invalid XML (column {error.offset + 1})") from None
    except RecursionError:
        raise _ExpansionError(_current(path), 0, "xacro: macros call each other without end") from None
    except Exception as error:  # expressions are Python and may raise anything
        raise _failure(_current(path), error) from None
    if macros and not has_links:
        names = shortened(", ".join(macros))
        raise _ExpansionError(path, 0, f"xacro: only macros ({names}) and no links; open a file that calls them")
    for name in arguments.given:
        if name not in arguments.asked:
            raise _ExpansionError(path, 0, f"xacro: there is no argument {name!r}{suggestion(name, arguments.asked)}")
    if len(expanded) > MAX_TEXT:
        raise _ExpansionError(path, 0, f"xacro: expands to more than {MAX_TEXT >> 20} MiB")
    return expanded


def _parsed_include(content: Any, name: str) -> Any:
    """Return an included file as xacro does, without what XML forbids."""
    path = Path(xacro.root_dir, name)
    if content is None and path.is_file():
        content = cleaned_text(path, Problems())
    return _parse(content, name)


def _find_packages_beside(path: Path) -> None:
    """Make `$(find PACKAGE)` search the folders for meshes, rather than an installation of ROS 2."""

    def find(name: str) -> str:
        found = next((folder for folder in package_folders(name, path) if folder.is_dir()), None)
        if found is None:
            raise xacro.substitution_args.SubstitutionException(
                f"there is no package {name!r} above this file or in ROS_PACKAGE_PATH"
            )
        return str(found)

    module = xacro.substitution_args
    module._eval_find = module._eval_dict["find"] = find


def _current(path: Path) -> Path:
    """Return the file that xacro was reading when it failed: the given one, or an included one."""
    stack = [name for name in xacro.filestack or [] if name]
    return Path(stack[-1]) if stack else path


def _failure(path: Path, error: Exception) -> _ExpansionError:
    if isinstance(error, MemoryError) or isinstance(getattr(error, "exc", None), MemoryError):
        return _ExpansionError(path, 0, f"xacro: needs more than {MAX_MEMORY >> 20} MiB of memory to expand")
    message = " ".join(str(error).split()) or type(error).__name__
    if missing := _UNDEFINED.search(message):
        name = missing[1]
        message = f"the argument {name!r} has no value; give one as {name}:=VALUE"
        return _ExpansionError(
            path, _line_of(path, f"'$(arg {name})'") or _line_of(path, f"'{name}'"), f"xacro: {message}"
        )
    for pattern, instead in _REPETITIONS:
        message = pattern.sub(instead, message)
    if isinstance(error, xacro.XacroException) and error.macros:
        names = ", ".join(macro.body.getAttribute("name") for macro in error.macros)
        message += f" (in the macro {names})"
    return _ExpansionError(path, _line_of(path, message), f"xacro: {shortened(message, _MAX_MESSAGE_LENGTH)}")


def _line_of(path: Path, message: str) -> int:
    """Return the line of a message, found by the text that it quotes; 0 if unknown."""
    try:
        with open_to_read(path) as stream:
            text = stream.read(MAX_TEXT).decode("utf-8", "replace")
    except (OSError, ValueError):
        return 0
    quoted = [next(filter(None, match.groups())) for match in _QUOTED.finditer(message)]
    for words in sorted(quoted, key=len, reverse=True):
        if len(words) > 2 and text.count(words) == 1:
            return text.count("\n", 0, text.index(words)) + 1
    return 0
