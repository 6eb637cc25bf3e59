"""Effects of the referee: one union of plain values."""

from dataclasses import is_dataclass
from typing import get_args

from cellwright.cell.kitting import effects


def test_every_effect_of_the_module_is_in_the_union() -> None:
    own = {name for name, each in vars(effects).items() if is_dataclass(each) and each.__module__ == effects.__name__}
    assert {each.__forward_arg__ for each in get_args(effects.Effect)} == own
