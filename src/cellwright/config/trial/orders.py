"""Section `orders`: the requested kits, and the announcement of each order."""

import math
from dataclasses import replace

from cellwright.config.parsing.python2 import dictionary_order
from cellwright.config.parsing.reader import Keys, Reader
from cellwright.config.parsing.schema import NUMBER, Elsewhere, mapping, suggested
from cellwright.config.parsing.tree import Entry, Items, Leaf, Table, YamlNode, describe, shortened
from cellwright.config.trial.other_years import OtherYear
from cellwright.config.trial.parts import MAX_PARTS, PART, PartRegistry, read_part
from cellwright.config.trial.short_orders import is_short, read_short_order
from cellwright.config.trial.trial import Kit, KitObject, Order
from cellwright.util.errors import suggestion

MAX_KITS = 10_000
"""Maximum number of kits and their parts in all orders of a trial."""

CONDITIONS = ("time", "wanted_parts", "unwanted_parts")

ORDER = Keys(
    {
        "announcement_condition": Elsewhere(suggested(CONDITIONS)),
        "announcement_condition_value": Elsewhere(NUMBER),
        "parts": Elsewhere(lambda: mapping(PART.schema())),
    },
    {"kit_count": Reader.whole},
    texts="orders",
)


def read_orders(node: YamlNode, registry: PartRegistry, other_year: OtherYear) -> tuple[Order, ...]:
    """Return the orders in the order of their ids."""
    reader = registry.reader
    if isinstance(node, Items):
        reader.problems.error(node, f"must be a mapping; a list of orders{other_year.format_hint(2023)}")
        return ()
    orders: dict[object, Order] = {}
    requested = 0
    for entry in reader.entries(node):
        order = _order(entry, registry, other_year)
        if order:
            requested += sum(1 + len(kit.objects) for kit in order.kits)
            orders[entry.name] = order
        if requested > MAX_KITS:
            reader.problems.error(node, f"asks for more than {MAX_KITS} kits and parts in total")
            return ()
    # The original copied the orders into a second dictionary and iterated over that.
    walked = [orders[name] for name in dictionary_order(orders)]
    ids = [f"order_{index}" for index in range(len(walked))]
    for own, order in zip(ids, walked, strict=True):
        if isinstance(node, Table) and order.yaml_name != own and order.yaml_name in ids:
            message = f"its id is {own}; ids follow the original's order of dictionaries"
            reader.problems.warn(node.entries[order.yaml_name], message)
    return tuple(replace(order, order_id=own) for own, order in zip(ids, walked, strict=True))


def _order(entry: Entry, registry: PartRegistry, other_year: OtherYear) -> Order | None:
    reader = registry.reader
    name = reader.key(entry)
    table = reader.table(entry.value)
    if table is None:
        return None
    if is_short(table):
        return None if name is None else read_short_order(name, table, registry)
    early = table.entries.get("announcement_time") if table.get("announcement_condition") is None else None
    reader.ignored(table, ORDER.names if early is None else (*ORDER.names, "announcement_time"))
    remark = other_year.order(table)
    if early is None:
        condition_node = reader.required(table, "announcement_condition", remark)
        value_node = reader.required(table, "announcement_condition_value", remark)
    else:
        reader.problems.error(early, other_year.announcement_message(early.value))
        condition_node = value_node = None
    parts_node = reader.required(table, "parts", remark)
    count_node = table.get("kit_count")
    kit_count = reader.whole(count_node) if count_node else 1
    parts = _parts(parts_node, registry) if parts_node else ()
    if condition_node is None or value_node is None or kit_count is None or name is None:
        return None
    if kit_count * max(1, len(parts)) > MAX_PARTS:
        reader.problems.error(entry, f"asks for more than {MAX_PARTS} parts")
        return None
    if kit_count == 0 or not parts:
        reader.problems.warn(entry, f"asks for no {'parts' if kit_count else 'kits'}")
    condition = _condition(condition_node, registry)
    value = _value(condition, value_node, registry)
    if value is None:
        return None
    # The original truncated a number of parts to a whole number, and ignored the condition if it was below 1.
    count = int(value) if value >= 1 else None
    return Order(
        order_id="",
        kits=tuple(Kit(f"{name}_kit_{k}", parts) for k in range(kit_count)),
        start_time=float(value) if condition == "time" else None,
        wanted_parts=count if condition == "wanted_parts" else None,
        unwanted_parts=count if condition == "unwanted_parts" else None,
        yaml_name=name,
        written=(condition, value),
    )


def _parts(node: YamlNode, registry: PartRegistry) -> tuple[KitObject, ...]:
    parts: list[KitObject] = []
    for entry in registry.reader.entries(node):
        part_table = registry.reader.table(entry.value)
        part = read_part(part_table, registry) if part_table else None
        if part:
            part_type, placement = part
            parts.append(KitObject(part_type, placement.pose, placement))
    return tuple(parts)


def _condition(node: YamlNode, registry: PartRegistry) -> str:
    """Return the word of the condition, with a warning for one that is never fulfilled."""
    word = node.value if isinstance(node, Leaf) else None
    if isinstance(word, str) and word in CONDITIONS:
        return word
    hint = suggestion(str(word).lower(), CONDITIONS)
    message = f"{describe(node)} is not a condition; the order is never announced{hint}"
    registry.reader.problems.warn(node, message)
    return shortened(str(word))


def _value(condition: str, node: YamlNode, registry: PartRegistry) -> float | None:
    """Return the figure of the condition: seconds, or a number of parts, which the original truncated."""
    reader = registry.reader
    if condition not in CONDITIONS:
        value = node.value if isinstance(node, Leaf) else None
        return value if isinstance(value, int | float) and math.isfinite(value) else 0.0
    value = reader.number(node)
    if value is None or condition == "time":
        return value
    if value != int(value):
        reader.problems.warn(node, f"must be a whole number of parts (got {value:g}); {int(value)} is used")
    if int(value) <= 0:
        reader.problems.warn(node, f"{condition} must be at least 1 (got {value:g}); the order is never announced")
    return value
