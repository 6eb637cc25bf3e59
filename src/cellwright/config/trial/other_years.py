"""Recognition of files of the competition's other years, so that errors can name the year.

The years are those in which an entry first appeared; later formats kept many entries.
"""

from collections.abc import Mapping

from cellwright.config.parsing.tree import Items, Leaf, Scalar, Table, YamlNode, children, shortened
from cellwright.util.errors import did_you_mean

EARLY = 2016
"""Formats before version 1.1 of the 2017 competition, some of which were in use until April 2017."""

_NAMES_NOW: Mapping[Scalar, str] = {
    "belt_models": "belt_parts",
    "faulty_products": "faulty_parts",
    "models_to_insert": "models_over_bins",
    "models_over_shelves": "models_over_bins",
    "products": "parts",
    "shipment_count": "kit_count",
}

_TOP_LEVEL: Mapping[Scalar, int] = {
    **dict.fromkeys(("belt_models", "faulty_products", "models_to_insert", "random_seed", "sensor_blackout"), 2018),
    "models_over_shelves": 2020,
    **dict.fromkeys(("agv_infos", "models_over_stations", "robot_health"), 2021),
    **dict.fromkeys(("sensor_health", "table_tray_infos"), 2022),
    **dict.fromkeys(("assembly_inserts", "challenges", "kitting_trays", "parts"), 2023),
}
_ORDER: Mapping[Scalar, int] = {
    "announcement_time": EARLY,
    **dict.fromkeys(("products", "shipments", "shipment_count"), 2018),
    **dict.fromkeys(("destinations", "agv_id"), 2019),
    **dict.fromkeys(("assembly", "assembly_robot_health", "kitting", "kitting_robot_health", "priority"), 2021),
    **dict.fromkeys(("announcement", "assembly_task", "combined_task", "kitting_task", "tasks"), 2023),
}
LATER_OPTIONS: Mapping[Scalar, int] = {
    **dict.fromkeys(("insert_bins", "visualize_sensor_views"), 2018),
    "insert_models_over_shelves": 2020,
}
LATER_SENSORS: Mapping[Scalar, int] = {
    **dict.fromkeys(("depth_camera", "quality_control"), 2018),
    **dict.fromkeys(("rgb_camera", "rgbd_camera"), 2020),
    "basic_logical_camera": 2022,
    "advanced_logical_camera": 2023,
}


class OtherYear:
    """The year of a configuration's probable format, by all its entries."""

    def __init__(self, root: Table) -> None:
        # `parts` is a mapping in the format of 2023; as a list it is Cellwright's own section
        is_own = isinstance(root.get("parts"), Items)
        years = [y for name in root.entries if (y := _TOP_LEVEL.get(name)) and not (is_own and name == "parts")]
        orders = root.get("orders")
        if isinstance(orders, Items):
            years.append(2023)
        for order in children(orders) if isinstance(orders, Table) else ():
            if isinstance(order, Table):
                years += [year for name in order.entries if (year := _ORDER.get(name))]
        self.year = max(years, default=None)

    def top_level_message(self, name: Scalar, valid: tuple[str, ...]) -> str:
        """Return the message for a top-level entry that the 2017 format does not have."""
        counterpart = _NAMES_NOW.get(name)
        meant = f"; did you mean {counterpart}" if counterpart else did_you_mean(str(name), valid)
        known = "" if meant else f" (known: {', '.join(valid)})"
        year = _TOP_LEVEL.get(name)
        return f"unknown top-level entry{'; it' if year else ''}{self.format_hint(year)}{meant}{known}"

    def order(self, table: Table) -> str:
        """Return a hint for an incomplete order that has another year's entries instead."""
        for name in table.entries:
            if year := _ORDER.get(name):
                counterpart = _NAMES_NOW.get(name)
                instead = f"; did you mean {counterpart} instead of {name!s}" if counterpart else ""
                return f"; {str(name)!r}{self.format_hint(year)}{instead}"
        return ""

    def announcement_message(self, node: YamlNode) -> str:
        """Return the replacement for the announcement of an order in an early file."""
        time = shortened(str(node.value)) if isinstance(node, Leaf) and node.value is not None else "0"
        return (
            f"this entry{self.format_hint(EARLY)}; write announcement_condition: time and "
            f"announcement_condition_value: {time} instead"
        )

    def format_hint(self, year: int | None) -> str:
        """Return a hint that an entry is of a year's format; empty for no year."""
        if year is None:
            return ""
        if year == EARLY:
            return " belongs to the 2016 format (used until April 2017); Cellwright reads the 2017 format"
        latest = max(year, self.year or year)
        later = "" if latest > year else " or a later one"
        return f" belongs to the {latest} format{later}; Cellwright reads the 2017 format"
