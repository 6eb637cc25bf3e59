"""Which values of a 2017 file are expressions: those under `xyz`, `rpy` and `initial_joint_states`, at any depth.

The original converted these before it looked at anything else, and it went into mappings only. So a bad expression is
an error wherever it stands, even in an entry that is otherwise ignored.
"""

import math

from cellwright.config.parsing.expressions import evaluate
from cellwright.config.parsing.problems import Problems
from cellwright.config.parsing.tree import Items, Leaf, Node, Table, described
from cellwright.util.errors import ExpressionError

_LISTS = ("xyz", "rpy")
_TABLES = ("initial_joint_states",)


def value(node: Node) -> float:
    """The finite number that an item stands for: arithmetic in a text, or a number.

    Texts are computed as Python 2 computed them, in which `1/2` is 0.

    Raises:
        ExpressionError: it stands for no finite number.
    """
    match node:
        case Leaf(value=str(text)):
            return evaluate(text, whole_division=True)
        case Leaf(value=int() | float() as number):
            if not math.isfinite(number):
                raise ExpressionError(f"{number} is not a finite number")
            return _as_float(number)
    raise ExpressionError(f"must be a number or an expression, not {described(node)}")


def check(node: Node, problems: Problems) -> None:
    """Report every item that is converted and has no value."""
    if not isinstance(node, Table):
        return
    for entry in node.entries.values():
        if entry.name in _LISTS:
            _check_list(entry.value, problems)
        elif entry.name in _TABLES:
            _check_table(entry.value, problems)
        else:
            check(entry.value, problems)


def _check_list(node: Node, problems: Problems) -> None:
    if not isinstance(node, Items):
        problems.error(node, f"must be a list of numbers, not {described(node)}")
        return
    for item in node.items:
        _check_item(item, problems)


def _check_table(node: Node, problems: Problems) -> None:
    if not isinstance(node, Table):
        problems.error(node, f"must be a mapping of joints to numbers, not {described(node)}")
        return
    for entry in node.entries.values():
        _check_item(entry.value, problems)


def _check_item(node: Node, problems: Problems) -> None:
    try:
        result = value(node)
    except ExpressionError as error:
        problems.error(node, str(error))
        return
    if isinstance(node, Leaf) and isinstance(node.value, str) and (meant := evaluate(node.value)) != result:
        problems.warn(
            node,
            f"{node.value!r} is {result:g}, for the original divided whole numbers without remainder; "
            f"write a decimal point (1.0/2) for {meant:g}",
        )


def _as_float(number: float) -> float:
    try:
        return float(number)
    except OverflowError:
        raise ExpressionError(f"{number} is too large") from None
