"""Overrides: values that replace those of a trial's files, from the command line or a program.

An override is a text `KEY=VALUE`. Its key is the dotted path that errors and warnings print, its value is YAML. It
changes the parsed tree, and everything behind the parser treats it as a value of the file.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from cellwright.config.parsing.sources import MAX_BYTES, JoinedText, Text
from cellwright.config.parsing.tree import (
    Entry,
    Items,
    Leaf,
    Place,
    Problem,
    Problems,
    Scalar,
    Table,
    YamlNode,
    children,
    describe,
    shortened,
)
from cellwright.config.parsing.yaml_source import MAX_DEPTH, MAX_NODES, flow_values, parse
from cellwright.util.errors import DescriptionError, UsageError

MAX_OVERRIDES = 100
"""Maximum number of overrides of one trial."""
MAX_KEY_LENGTH = 500
"""Maximum length of a key, in characters."""

_BEFORE_ALL_FILES = -1
_NAME = re.compile(r"\.([^.\[\]]+)")
_INDEX = re.compile(r"\[(\d{1,9})\]", re.ASCII)


@dataclass(frozen=True, slots=True)
class Override:
    """Value that replaces the one under a key.

    Attributes:
        key: dotted path to the value, such as `orders.order_0.parts.part_1.pose.xyz[0]`.
        value: the value as YAML text.
        option: the source that errors name, such as `--set`.

    Example:
        >>> override = Override.read("options.belt_population_cycles=2")
        >>> override.key, override.value, str(override)
        ('options.belt_population_cycles', '2', 'options.belt_population_cycles=2')
    """

    key: str
    value: str
    option: str = field(default="overrides", compare=False)

    @classmethod
    def read(cls, text: str, option: str = "overrides") -> Override:
        """Read `KEY=VALUE`.

        Raises:
            UsageError: the text has no equals sign, or no key before it, or a too long one.
        """
        key, separator, value = (each.strip() for each in text.partition("="))
        if not key or not separator:
            raise UsageError(f"{option}: must be KEY=VALUE (got {shortened(repr(text))}); write it as in time_limit=60")
        if len(key) > MAX_KEY_LENGTH:
            raise UsageError(f"{option}: a key must have at most {MAX_KEY_LENGTH} characters (got {len(key)})")
        return cls(key, value, option)

    @property
    def place(self) -> Place:
        """The place of its values; it sorts before those in files."""
        return Place(_BEFORE_ALL_FILES, self.option, 0)

    def __str__(self) -> str:
        return f"{self.key}={self.value}"


class _ValueText(JoinedText):
    """Text of an override's value, which is all at one place."""

    def __init__(self, override: Override) -> None:
        super().__init__([Text(override.option, override.value)])
        self._override = override

    def place(self, index: int) -> Place:
        """Return the place of the override."""
        del index
        return self._override.place


def read_values(option: str, text: str) -> list[str]:
    """Return the YAML texts of values with commas between them, such as `1, [0, 2]` or `{a: 1}, true`.

    Raises:
        UsageError: the text is something else.
    """
    try:
        return flow_values(JoinedText([Text(option, f"[{text}]")]))
    except DescriptionError as error:
        (problem,) = error.problems
        message = problem.message if isinstance(problem, Problem) else str(problem)
        raise UsageError(
            f"{option}: {message} in {shortened(text)!r}; write them as in 60,120 or [0, 1],[0, 2]"
        ) from None


def apply_overrides(root: Table, overrides: Sequence[Override], problems: Problems) -> Table:
    """Return the tree with the values of the overrides, in their order; those that are not possible are reported.

    Missing mappings are made, and a new entry comes last in its mapping. Entries of lists must exist.
    """
    size = sum(len(each.key) + len(each.value) for each in overrides)
    if len(overrides) > MAX_OVERRIDES or size > MAX_BYTES:
        bound = f"at most {MAX_OVERRIDES} with {MAX_BYTES // 1024} KiB in total"
        problems.error(overrides[0], f"too many overrides (got {len(overrides)}, {bound})")
        return root
    found: YamlNode = root
    values = 0
    for override in overrides:
        try:
            value = _parsed(override, problems)
            values += _count(value)
            if values > MAX_NODES:
                raise DescriptionError(
                    [_problem(override, f"more than {MAX_NODES} values; each use of an alias counts")]
                )
            found = _replaced(found, "", override, value)
        except DescriptionError as error:
            for problem in error.problems:
                problems.error(override, problem.message if isinstance(problem, Problem) else str(problem))
    return found if isinstance(found, Table) else root


def refuse_without_effect(overrides: Sequence[Override], problems: Problems) -> None:
    """Turn warnings about overrides into errors: an override that the trial ignores would have no effect."""

    def refused(warning: Problem) -> Problem | None:
        if warning.place.file == _BEFORE_ALL_FILES:
            return replace(warning, severity="error")
        for override in overrides if warning.ignored else ():
            if _leads_to(warning.ignored, override.key):
                where = f"{warning.place}: {warning.key}"
                return Problem(override.place, override.key, f"{warning.message} ({where})")
        return None

    problems.refuse(refused)


def _problem(override: Override, message: str) -> Problem:
    return Problem(override.place, override.key, message)


def _parsed(override: Override, problems: Problems) -> YamlNode:
    value = parse(_ValueText(override), problems, override.key)
    return Leaf(None, override.place, override.key) if value is None else value


def _count(node: YamlNode) -> int:
    return 1 + sum(map(_count, children(node)))


def _leads_to(key: str, longer: str) -> bool:
    """Return whether a key is that of a node on the way to another, or the same."""
    return longer == key or (longer.startswith(key) and longer[len(key)] in ".[")


def _replaced(node: YamlNode | None, key: str, override: Override, value: YamlNode, depth: int = 0) -> YamlNode:
    """Return the node under `key` with the value at the override's key; None stands for a missing node."""
    if key == override.key:
        return value
    rest = override.key[len(key) :]
    if depth > MAX_DEPTH:
        raise DescriptionError([_problem(override, f"nested deeper than {MAX_DEPTH} levels")])
    match node:
        case Items():
            index = _INDEX.match(rest)
            if index is None or int(index[1]) >= len(node.items):
                message = f"{key} is a list of {len(node.items)}; give an index from [0] to [{len(node.items) - 1}]"
                raise DescriptionError([_problem(override, message if node.items else f"{key} is an empty list")])
            at = int(index[1])
            item = _replaced(node.items[at], f"{key}[{at}]", override, value, depth + 1)
            return replace(node, items=(*node.items[:at], item, *node.items[at + 1 :]))
        case None | Table() | Leaf(value=None):
            table = node if isinstance(node, Table) else Table(override.place, key)
            name, path = _entry(table, rest, override)
            old = table.entries.get(name)
            inner = _replaced(old.value if old else None, path, override, value, depth + 1)
            if old is None or path == override.key:
                entry = Entry(name, inner, override.place, path)
            else:
                entry = replace(old, value=inner)
            return replace(table, entries={**table.entries, name: entry})
        case _:
            raise DescriptionError([_problem(override, f"{key} is {describe(node)}; it has no entries")])


def _entry(table: Table, rest: str, override: Override) -> tuple[Scalar, str]:
    """Return name and path of the entry that leads to the override's key, which may be a new one."""
    there = [entry for entry in table.entries.values() if _leads_to(entry.key, override.key)]
    if there:
        entry = max(there, key=lambda entry: len(entry.key))
        return entry.name, entry.key
    found = _NAME.match(rest if table.key else f".{rest}")
    if found is None:
        where = f"{table.key} is a mapping" if table.key else "not a path"
        message = f"{where}; give a path of names with . between them, and [0] for the first of a list"
        if table.key and not table.entries:
            message = f"there is no list {table.key}; set it as a whole"
        raise DescriptionError([_problem(override, message)])
    named = parse(JoinedText([Text(override.option, found[1])]), Problems())
    if not isinstance(named, Leaf):
        raise DescriptionError([_problem(override, f"{shortened(found[1])} is not a name")])
    return named.value, f"{table.key}{found[0]}" if table.key else found[1]
