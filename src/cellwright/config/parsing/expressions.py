"""Arithmetic expressions in configuration files, evaluated without running code.

A value such as `-pi/1.5` or `radians(30)` is parsed to a syntax tree. Only numbers, `+ - * / **`, parentheses and the
names of Python's math module are evaluated. All costs are bounded, so that every text evaluates quickly.

The original converted expressions before it read anything else, and only inside mappings. So a bad expression is an
error anywhere, even in an entry that is otherwise ignored.
"""

import ast
import math
import warnings
from collections.abc import Mapping
from typing import TypeAlias

from cellwright.config.parsing.python2 import quotient
from cellwright.config.parsing.tree import Items, Leaf, Problems, Scalar, Table, YamlNode, children, describe, shortened
from cellwright.util.errors import ExpressionError, did_you_mean

MAX_LENGTH = 200
"""Maximum length of an expression in characters; it also bounds the nesting."""
MAX_BITS = 4096
"""Maximum size of an intermediate whole number, in bits; a result must fit a float."""
MAX_COMBINATORIC = 1000
"""Maximum argument of the functions whose cost grows with it."""

Number: TypeAlias = int | float

_NAMES = tuple(name for name in vars(math) if not name.startswith("_"))
_COMBINATORIC = frozenset({"factorial", "comb", "perm"})
_FLOAT_IN_PYTHON_2 = frozenset({"floor", "ceil"})
_CONVERTED: Mapping[Scalar, tuple[type, str]] = {
    "xyz": (Items, "a list of numbers"),
    "rpy": (Items, "a list of numbers"),
    "initial_joint_states": (Table, "a mapping of joints to numbers"),
}


def evaluate(text: str, *, whole_division: bool = False) -> float:
    """Return the finite value of an arithmetic expression.

    Args:
        text: the expression, such as `-pi/1.5`.
        whole_division: divide two whole numbers as Python 2 did, rounding down (`1/2` is 0).

    Raises:
        ExpressionError: the text is not arithmetic, uses a name that is not in the math module, or has no finite value.

    Example:
        >>> evaluate("-pi/2"), evaluate("3/2"), evaluate("3/2", whole_division=True)
        (-1.5707963267948966, 1.5, 1.0)
    """
    if len(text) > MAX_LENGTH:
        raise ExpressionError(f"an expression must have at most {MAX_LENGTH} characters (got {len(text)})")
    with warnings.catch_warnings():
        # users need no warnings of the parser and the math module
        warnings.simplefilter("ignore")
        value = _Evaluator(text.strip(), whole_division=whole_division).value()
    return _finite(value, repr(text.strip()))


def _finite(value: Number, shown: str) -> float:
    try:
        result = float(value)
    except OverflowError:
        raise ExpressionError(f"{shown} is too large") from None
    if not math.isfinite(result):
        raise ExpressionError(f"{shown} is not a finite number")
    return result


class _Evaluator:
    """Evaluator of the syntax tree of one expression."""

    def __init__(self, text: str, *, whole_division: bool) -> None:
        self._text = text
        self._whole_division = whole_division

    def value(self) -> Number:
        try:
            tree = ast.parse(self._text, mode="eval")
        except (SyntaxError, ValueError, MemoryError, RecursionError):
            hint = "; write the minus sign as -" if {"−", "–"} & set(self._text) else ""
            raise self._refuse(f"is not an arithmetic expression{hint}") from None
        try:
            return self._node(tree.body)
        except ExpressionError:
            raise
        except ZeroDivisionError:
            raise self._refuse("divides by zero") from None
        except OverflowError:
            raise self._refuse("is too large") from None
        except (ValueError, TypeError) as error:
            raise self._refuse(f"has no value: {error}") from None
        except RecursionError:
            raise self._refuse("is nested too deeply") from None

    def _refuse(self, reason: str) -> ExpressionError:
        return ExpressionError(f"{self._text!r} {reason}")

    def _node(self, node: ast.expr) -> Number:
        match node:
            case ast.Constant(value=int() | float() as number) if not isinstance(number, bool):
                value: Number = number
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                value = -self._node(operand)
            case ast.UnaryOp(op=ast.UAdd(), operand=operand):
                value = self._node(operand)
            case ast.BinOp(left=left, op=op, right=right):
                value = self._operation(op, self._node(left), self._node(right))
            case ast.Name(id=name):
                constant = self._look_up(name)
                if not isinstance(constant, float):
                    raise self._refuse(f"uses the function {name} without calling it")
                value = constant
            case ast.Call(func=ast.Name(id=name), args=arguments, keywords=[]):
                value = self._call(name, [self._node(argument) for argument in arguments])
            case _:
                raise self._refuse("must consist of numbers, + - * / **, parentheses and names of the math module")
        if isinstance(value, int) and value.bit_length() > MAX_BITS:
            raise self._refuse("is too large")
        return value

    def _look_up(self, name: str) -> object:
        if name not in _NAMES:
            raise self._refuse(f"uses {name!r}, which is not in Python's math module{did_you_mean(name, _NAMES)}")
        return getattr(math, name)

    def _operation(self, op: ast.operator, a: Number, b: Number) -> Number:
        match op:
            case ast.Add():
                return a + b
            case ast.Sub():
                return a - b
            case ast.Mult():
                return a * b
            case ast.Div():
                return quotient(a, b) if self._whole_division else a / b
            case ast.Pow():
                if isinstance(a, int) and isinstance(b, int) and b > 0 and a.bit_length() * b > MAX_BITS and abs(a) > 1:
                    raise self._refuse("is too large")
                power: Number | complex = a**b
                if isinstance(power, complex):
                    raise self._refuse("takes the root of a negative number")
                return power
            case _:
                raise self._refuse("uses an operator other than + - * / **")

    def _call(self, name: str, arguments: list[Number]) -> Number:
        function = self._look_up(name)
        if not callable(function):
            raise self._refuse(f"calls {name}, which is a number")
        if name in _COMBINATORIC and any(abs(argument) > MAX_COMBINATORIC for argument in arguments):
            raise self._refuse("is too large")
        result = function(*arguments)
        if not isinstance(result, int | float):
            raise self._refuse(f"uses {name}, which does not return a number")
        return float(result) if self._whole_division and name in _FLOAT_IN_PYTHON_2 else result


def expression_value(node: YamlNode) -> float:
    """Return the finite number of an item: an expression in a text, or a number.

    Texts are evaluated as in Python 2, where `1/2` is 0.

    Raises:
        ExpressionError: the item has no finite value.
    """
    match node:
        case Leaf(value=str(text)):
            return evaluate(text, whole_division=True)
        case Leaf(value=int() | float() as number):
            return _finite(number, shortened(str(number)))
    raise ExpressionError(f"must be a number or an expression (got {describe(node)})")


def check_expressions(node: YamlNode, problems: Problems) -> None:
    """Report every converted item that has no value."""
    for entry in node.entries.values() if isinstance(node, Table) else ():
        kind, expected = _CONVERTED.get(entry.name, (None, ""))
        if kind is None:
            check_expressions(entry.value, problems)
        elif not isinstance(entry.value, kind):
            problems.error(entry.value, f"must be {expected} (got {describe(entry.value)})")
        else:
            for item in children(entry.value):
                _check_item(item, problems)


def _check_item(node: YamlNode, problems: Problems) -> None:
    try:
        result = expression_value(node)
    except ExpressionError as error:
        problems.error(node, str(error))
        return
    if isinstance(node, Leaf) and isinstance(node.value, str) and (meant := evaluate(node.value)) != result:
        problems.warn(
            node,
            f"{node.value!r} is {result:g}, the integer division of Python 2; "
            f"write a decimal point (1.0/2) for {meant:g}",
        )
