"""Model names and what they say about a part.

A model in the cell is called `bin7|piston_rod_part_3` or `populate_conveyor|gear_part_clone_0`: where it came from, its
type, and a number. Faults and camera frames go by the name without its origin, kits by the type alone.
"""

import re

# A number or a clone mark is cut off only where at least two characters are left before it: the competition's own
# rule, by which `a_2` is a type of its own.
_NUMBER = re.compile(r"(?<=..)_[0-9]+\Z", re.DOTALL)
_SHORTEST_TYPE = 2


def trimmed_name(model_name: str) -> str:
    """The name without its origin: `bin7|piston_rod_part_3` becomes `piston_rod_part_3`."""
    return model_name.rpartition("|")[2]


def part_type(model_name: str) -> str:
    """The type in a model name: of `bin7|piston_rod_part_3` and of `x|piston_rod_part_clone_0`, `piston_rod_part`.

    First the origin goes, then a trailing `_<number>`, then everything from the last `_clone` on.
    """
    name = _NUMBER.sub("", trimmed_name(model_name))
    clone = name.rfind("_clone")
    return name[:clone] if clone >= _SHORTEST_TYPE else name
