"""Lists of plain coordinates, which have no expressions."""

from cellwright.config.parsing.reader import Read, Reader
from cellwright.config.parsing.schema import accepts, array
from cellwright.config.parsing.tree import Items, Leaf, YamlNode, describe


def coordinates(minimum: int) -> Read:
    """Return a reader of at least `minimum` plain numbers [m]; whole numbers stay whole: their division rounds down."""

    @accepts(array({"type": "number"}, minimum))
    def read(reader: Reader, node: YamlNode) -> tuple[float, ...] | None:
        if not isinstance(node, Items):
            reader.problems.error(node, f"must be a list of three numbers (got {describe(node)})")
            return None
        wrong_count = f"must be a list of three numbers (got a list of {len(node.items)})"
        if len(node.items) < minimum:
            reader.problems.error(node, wrong_count)
            return None
        if len(node.items) > 3:
            reader.problems.warn(node, f"{wrong_count}; the others are ignored")
        numbers: list[float] = []
        for item in node.items[:3]:
            if isinstance(item, Leaf) and isinstance(item.value, int | float):
                number = reader.finite(item, item.value)
            else:
                number = None
                reader.problems.error(
                    item, f"must be a plain number (got {describe(item)}); this list has no expressions"
                )
            if number is not None:
                numbers.append(number)
        complete = len(numbers) == len(node.items[:3])
        return tuple(numbers) if complete and reader.check_coordinates(node, numbers) else None

    return read
