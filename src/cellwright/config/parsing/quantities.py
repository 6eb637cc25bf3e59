"""Readers of quantities: numbers within bounds that may be expressions such as `pi/2`, and lists of them."""

from cellwright.config.parsing import expressions, schema
from cellwright.config.parsing.reader import Read, Reader
from cellwright.config.parsing.schema import accepts
from cellwright.config.parsing.tree import Items, Leaf, YamlNode, describe
from cellwright.util.errors import ExpressionError


@accepts(schema.EXPRESSION)
def read_quantity(reader: Reader, node: YamlNode) -> float | None:
    """Return a finite number, which may be an expression; unlike in the format of 2017, `1/2` is a half."""
    try:
        match node:
            case Leaf(value=str(text)):
                return expressions.evaluate(text)
            case Leaf(value=int() | float() as value) if not isinstance(value, bool):
                found = reader.finite(node, value)
                return None if found is None else float(found)
    except ExpressionError as error:
        reader.problems.error(node, str(error))
        return None
    reader.problems.error(node, f"must be a number or an expression such as pi/2 (got {describe(node)})")
    return None


def quantity(minimum: float, maximum: float, unit: str) -> Read:
    """Return a reader of a number within bounds, which may be an expression."""
    bounds = f"{minimum:g} to {maximum:g} {unit}".rstrip()

    @accepts(schema.bounded(schema.EXPRESSION, minimum, maximum))
    def read(reader: Reader, node: YamlNode) -> float | None:
        found = read_quantity(reader, node)
        if found is None or minimum <= found <= maximum:
            return found
        reader.problems.error(node, f"must be from {bounds} (got {found:g})")
        return None

    return read


def quantities(counts: tuple[int, ...], each: Read, example: str) -> Read:
    """Return a reader of a list of quantities, with one of several `counts`; the error shows the `example`."""

    @accepts(schema.array(schema.schema_of(each), min(counts), max(counts)))
    def read(reader: Reader, node: YamlNode) -> tuple[float, ...] | None:
        if not isinstance(node, Items) or len(node.items) not in counts:
            found = f"a list of {len(node.items)}" if isinstance(node, Items) else describe(node)
            reader.problems.error(node, f"must be {example} (got {found})")
            return None
        values = [each(reader, item) for item in node.items]
        return None if None in values else tuple(values)

    return read
