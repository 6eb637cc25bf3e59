"""The `options` of the 2017 format, and the aliases that part types may be written by."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.tree import Leaf, Node, described
from cellwright.config.trial.keys import ALIASES, CYCLES, DEFAULT_ALIASES, OPTIONS, SWITCHES
from cellwright.config.trial.other_years import year_of_option
from cellwright.config.trial.trial import Options
from cellwright.util.errors import did_you_mean


@dataclass(frozen=True, slots=True)
class OptionFigures:
    """The options and the aliases of part types."""

    options: Options = field(default_factory=Options)
    aliases: Mapping[str, str] = field(default_factory=lambda: dict(DEFAULT_ALIASES))

    def resolve(self, part_type: str) -> str:
        """The part type that a name stands for; an alias of an alias is not followed."""
        return self.aliases.get(part_type, part_type)


def read_options(node: Node, reader: Reader) -> OptionFigures:
    """The section `options`."""
    table = reader.table(node)
    if table is None:
        return OptionFigures()
    switches: dict[str, bool] = {}
    cycles = Options().belt_population_cycles
    aliases: Mapping[str, str] = DEFAULT_ALIASES
    for entry in table.entries.values():
        if entry.name in SWITCHES.names:
            switches[str(entry.name)] = _truth(entry.value, reader)
        elif entry.name == CYCLES:
            cycles = reader.whole(entry.value) or 0
        elif entry.name == ALIASES:
            aliases = _aliases(entry.value, reader)
        else:
            year = year_of_option(entry.name)
            origin = f" (it came with the {year} format)" if year else ""
            reader.problems.warn(
                entry, f"unknown option, ignored{origin}{did_you_mean(str(entry.name), OPTIONS.names)}"
            )
    return OptionFigures(Options(belt_population_cycles=cycles, **switches), aliases)


def _truth(node: Node, reader: Reader) -> bool:
    """A switch. Whatever is no truth value counts as Python counts it, as it did in the original."""
    if isinstance(node, Leaf) and isinstance(node.value, bool):
        return node.value
    truth = bool(node.value) if isinstance(node, Leaf) else len(_members(node)) > 0
    reader.problems.warn(node, f"should be true or false; {described(node)} counts as {str(truth).lower()}")
    return truth


def _members(node: Node) -> tuple[object, ...]:
    return tuple(getattr(node, "items", None) or getattr(node, "entries", None) or ())


def _aliases(node: Node, reader: Reader) -> Mapping[str, str]:
    table = reader.table(node)
    aliases: dict[str, str] = {}
    for entry in table.entries.values() if table else ():
        alias, part_type = reader.key(entry), reader.name(entry.value)
        if alias is not None and part_type is not None:
            aliases[alias] = part_type
    return aliases
