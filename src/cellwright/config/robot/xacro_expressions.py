"""Keeps the expressions of xacro files to reckoning.

xacro evaluates them as Python without its built-in functions, which is no wall: from any value a way of attributes
leads to everything that is loaded. So attributes that lead inwards are refused, and functions that open such a way are
taken out. What an expression costs is bounded by the process that it runs in (`xacro_program.py`).
"""

from __future__ import annotations

import ast
from typing import Any

import xacro
import xacro.substitution_args

_INWARDS = frozenset(
    {
        *("format", "format_map", "mro"),  # a format can name attributes, too
        *("gi_frame", "gi_code", "gi_yieldfrom", "cr_frame", "cr_code", "cr_await", "cr_origin"),
        *("ag_frame", "ag_code", "ag_await", "f_back", "f_builtins", "f_code", "f_globals", "f_locals"),
        *("tb_frame", "tb_next", "co_code", "co_consts", "co_names"),
    }
)
_WITHOUT = ("type", "vars")


def keep_to_reckoning() -> None:
    """Have xacro, in this process, evaluate nothing that could do more than reckon."""
    xacro.safe_eval = _evaluated
    xacro.substitution_args._eval = _substituted
    for name in _WITHOUT:
        xacro._global_symbols["python"].pop(name, None)


def check(expression: str) -> None:
    """Refuse an expression that reaches for the innards of Python.

    Raises:
        XacroException: it does; the text names what it reached for.
        SyntaxError: it is no expression.
    """
    for node in ast.walk(ast.parse(expression, "<expression>", "eval")):
        name = node.attr if isinstance(node, ast.Attribute) else node.id if isinstance(node, ast.Name) else ""
        is_inner = name.startswith("_") if isinstance(node, ast.Attribute) else name.startswith("__")
        if is_inner or (isinstance(node, ast.Attribute) and name in _INWARDS):
            raise xacro.XacroException(f"an expression must not use {name!r}")


def _evaluated(expression: str, names: dict[str, Any], others: Any = None) -> Any:
    """What stands in `${…}`."""
    text = expression.strip()
    check(text)
    names.update(__builtins__={})
    return eval(text, names, others)  # noqa: S307


def _substituted(text: str, context: dict[str, Any]) -> str:
    """What stands in `$(eval …)`."""
    text = text.strip()
    check(text)
    module = xacro.substitution_args
    arguments = context.setdefault("arg", {})
    known = {
        **module._eval_dict,
        "arg": lambda name: module.convert_value(module._eval_arg(name, args=arguments), "auto"),
        "dirname": lambda: module._eval_dirname(context["filename"]),
    }
    builtins = module._eval_dict["__builtins__"]
    return str(eval(text, {"__builtins__": builtins}, module._DictWrapper(arguments, known)))  # noqa: S307
