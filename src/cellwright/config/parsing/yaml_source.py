"""YAML parser: text to a tree with places, by PyYAML's rules and within bounds.

The rules are PyYAML's (YAML 1.1), since the original used it. `yes` is true, `010` is eight, `1:30` is ninety, `1e3`
is text. The last of two equal keys counts. Anything that could carry code or grow without limit is refused.
"""

from collections.abc import Collection, Hashable, Iterator
from contextlib import contextmanager
from typing import Any

import yaml
from yaml.nodes import CollectionNode, MappingNode, ScalarNode, SequenceNode

from cellwright.config.parsing.sources import MAX_BYTES, JoinedText
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
    describe,
    shortened,
)
from cellwright.util.errors import DescriptionError

MAX_DEPTH = 50
"""Maximum nesting of lists and mappings, with aliases followed."""
MAX_NODES = 50_000
"""Maximum number of values in a file; each use of an alias counts in full."""
MAX_SCALAR = 10_000
"""Maximum length of a single value in characters."""

_MAX_KEY_LENGTH = 80
_FAST_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
_MAP, _SEQUENCE, _MERGE, _VALUE = (f"tag:yaml.org,2002:{kind}" for kind in ("map", "seq", "merge", "value"))


def parse(text: JoinedText, problems: Problems, key: str = "") -> YamlNode | None:
    """Return the single document in the text, or None if it is empty.

    Args:
        text: the text.
        problems: receives problems of keys.
        key: dotted path to the document's value, if it is part of another.

    Raises:
        DescriptionError: the text is not valid or supported YAML.
    """
    with _composed(text) as (loader, root):
        return _TreeBuilder(loader, text, problems).node(root, key) if root is not None else None


def flow_values(text: JoinedText) -> list[str]:
    """Return the texts of the items of the single flow sequence that the text is, such as `[1, {a: 2}]`.

    Raises:
        DescriptionError: the text is not valid or supported YAML, or something else.
    """
    with _composed(text) as (_, root):
        if not isinstance(root, SequenceNode) or root.start_mark.index or root.end_mark.index != len(text.content):
            raise _refusal(text, 0, "must be values with commas between them")
        return [text.content[item.start_mark.index : item.end_mark.index].strip() for item in root.value]


@contextmanager
def _composed(text: JoinedText) -> Iterator[tuple["_Composer", yaml.Node | None]]:
    """Provide the node of the single document in the text, and its composer; errors of either become a refusal."""
    # as many characters cost as much as that many bytes of a file
    if len(text.content) > MAX_BYTES:
        raise _refusal(text, 0, f"more than {MAX_BYTES // 1024} KiB of text")
    try:
        loader = _Composer(text.content)
        try:
            yield loader, loader.get_single_node()
        finally:
            loader.dispose()
    except yaml.reader.ReaderError as error:
        position = error.position if isinstance(error.position, int) else 0
        raise _refusal(text, position, "invalid character; is this a YAML file?") from None
    except _UnsupportedYamlError as error:
        raise _refusal(text, error.problem_mark.index if error.problem_mark else 0, str(error.problem)) from None
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        message = error.problem or error.context or "cannot be parsed"
        if message == "but found another document":
            message = "a second document starts here; remove the line ---"
        elif "'\\t'" in message:
            message = "tabs are not allowed here; use spaces"
        raise _refusal(text, mark.index if mark else 0, f"invalid YAML: {message}") from None
    except RecursionError:
        raise _refusal(text, 0, f"nested deeper than {MAX_DEPTH} levels") from None


def parse_packaged(text: JoinedText) -> Table:
    """Return the top level of a file of the package, which needs no bounds: with the parser in C where there is one."""
    loader = _PackagedLoader(text.content)
    try:
        root = _TreeBuilder(loader, text, Problems()).node(loader.get_single_node(), "")
    finally:
        loader.dispose()
    assert isinstance(root, Table)
    return root


def parse_mapping(text: JoinedText, problems: Problems, expected: str) -> Table:
    """Return the top level of the single document in the text; an empty text is an empty table.

    `expected` is what the error names as expected: "a configuration must be a mapping of sections".

    Raises:
        DescriptionError: the text is not valid or supported YAML, or not a mapping.
    """
    root = parse(text, problems)
    if root is None or (isinstance(root, Leaf) and root.value is None):
        return Table(Place(0, text.place(0).path, 0), "")
    if isinstance(root, Table):
        return root
    message = f"{expected} (got {describe(root)}){text.glue_hint(root.place)}"
    raise DescriptionError([*problems.errors, Problem(root.place, "", message)], problems.warnings)


def refuse_lost_indentation(root: Table, sections: Collection[Scalar]) -> None:
    """Refuse a file whose sections are empty because their entries stand below them without indentation.

    Each of these entries would be an error or a warning of its own.

    Raises:
        DescriptionError: it has lost its indentation.
    """
    unknown = sorted(entry.place for entry in root.entries.values() if entry.name not in sections)
    for entry in root.entries.values():
        is_empty = isinstance(entry.value, Leaf) and entry.value.value is None
        if not is_empty or entry.name not in sections or len(unknown) < 2:
            continue
        following = [each for each in root.entries.values() if each.place > entry.place]
        first = min(following, key=lambda each: each.place, default=None)
        if first is not None and first.name not in sections:
            name = shortened(str(first.name))
            message = f"the section is empty, and {name!r} below it is no section; indent the entries of each section"
            raise DescriptionError([Problem(entry.place, entry.key, message)])


def _refusal(text: JoinedText, index: int, message: str) -> DescriptionError:
    place = text.place(index)
    return DescriptionError([Problem(place, "", message + text.glue_hint(place))])


class _UnsupportedYamlError(yaml.MarkedYAMLError):
    """YAML that may be valid but is refused here."""


class _Composer(yaml.SafeLoader):
    """Composer of the node graph that measures it at the same time, so that it detects alias bombs early."""

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._depth = 0
        self._values = 0
        self._measures: dict[yaml.Node, tuple[int, int]] = {}

    def compose_node(self, parent: yaml.Node | None, index: Any) -> yaml.Node | None:
        mark = self.peek_event().start_mark  # type: ignore[no-untyped-call]
        is_alias = self.check_event(yaml.AliasEvent)
        self._depth += 1
        if self._depth > MAX_DEPTH:
            raise _UnsupportedYamlError(problem=f"nested deeper than {MAX_DEPTH} levels", problem_mark=mark)
        # a collection is measured at its end, which may be far
        self._values += 1
        if self._values > MAX_NODES:
            raise _too_many_values(mark)
        node = super().compose_node(parent, index)
        self._depth -= 1
        if node is not None and not is_alias:
            self._measures[node] = self._measure(node, mark)
        elif node is not None and node not in self._measures:
            raise _UnsupportedYamlError(problem="an anchor contains itself", problem_mark=mark)
        return node

    def _measure(self, node: yaml.Node, mark: yaml.Mark) -> tuple[int, int]:
        """Return the number of values in a node and its depth, and refuse excessive ones."""
        if not isinstance(node, CollectionNode):
            return 1, 1
        pairs = node.value if isinstance(node, MappingNode) else [(item,) for item in node.value]
        children = [self._measures[child] for pair in pairs for child in pair]
        count = 1 + sum(child[0] for child in children)
        depth = 1 + max((child[1] for child in children), default=0)
        if count > MAX_NODES:
            raise _too_many_values(mark)
        if depth > MAX_DEPTH:
            raise _UnsupportedYamlError(problem=f"nested deeper than {MAX_DEPTH} levels", problem_mark=mark)
        return count, depth


def _too_many_values(mark: yaml.Mark) -> _UnsupportedYamlError:
    return _UnsupportedYamlError(
        problem=f"more than {MAX_NODES} values; each use of an alias counts", problem_mark=mark
    )


class _PackagedLoader(_FAST_LOADER):  # type: ignore[misc]
    """Loader that looks at each text once: keys and numbers of a layout come again and again."""

    def __init__(self, stream: str) -> None:
        super().__init__(stream)
        self._tags: dict[Any, Any] = {}
        self._values: dict[Any, Any] = {}

    def resolve(self, kind: Any, value: Any, implicit: Any) -> Any:
        if kind is not ScalarNode:
            return super().resolve(kind, value, implicit)
        key = (value, implicit)
        if key not in self._tags:
            self._tags[key] = super().resolve(kind, value, implicit)
        return self._tags[key]

    def construct_object(self, node: Any, deep: bool = False) -> Any:  # noqa: FBT001
        key = (node.tag, node.value)
        if key not in self._values:
            self._values[key] = super().construct_object(node, deep)
        return self._values[key]


class _TreeBuilder:
    """Builder of the tree from PyYAML's nodes."""

    def __init__(self, loader: Any, text: JoinedText, problems: Problems) -> None:
        self._loader = loader
        self._text = text
        self._problems = problems

    def node(self, node: yaml.Node, key: str, place: Place | None = None) -> YamlNode:
        """Return the tree of one node; a collection under a key has the place of its key."""
        place = place or self._text.place(node.start_mark.index)
        if isinstance(node, MappingNode):
            self._check_tag(node, _MAP)
            return self._table(node, place, key)
        if isinstance(node, SequenceNode):
            self._check_tag(node, _SEQUENCE)
            return Items(tuple(self.node(item, f"{key}[{i}]") for i, item in enumerate(node.value)), place, key)
        return Leaf(self._scalar(node), place, key)

    def _table(self, node: MappingNode, place: Place, key: str) -> Table:
        table = Table(place, key)
        merged, own = self._pairs(node)
        written: set[Scalar] = set()
        for position, (key_node, value_node) in enumerate(merged + own):
            if not isinstance(key_node, ScalarNode):
                raise self._invalid(key_node, "a list or mapping cannot be a key")
            name = self._scalar(key_node)
            own_key = shortened(str(name), _MAX_KEY_LENGTH)
            path = f"{key}.{own_key}" if key else own_key
            at = self._text.place(key_node.start_mark.index)
            if position >= len(merged):
                if name in written:
                    first = table.entries[name].place
                    message = (
                        f"replaces the entry of {first}"
                        if first.file != at.file
                        else f"duplicate key (first at {first}); this one is used"
                    )
                    self._problems.add(Problem(at, path, message, "warning"))
                written.add(name)
            table.entries[name] = Entry(name, self.node(value_node, path, at), at, path)
        return table

    def _pairs(self, node: MappingNode) -> tuple[list[tuple[yaml.Node, yaml.Node]], list[tuple[yaml.Node, yaml.Node]]]:
        """Return the entries from merge keys (`<<`), in PyYAML's order, and a mapping's own."""
        merged: list[tuple[yaml.Node, yaml.Node]] = []
        own: list[tuple[yaml.Node, yaml.Node]] = []
        for key_node, value_node in node.value:
            if key_node.tag != _MERGE:
                own.append((key_node, value_node))
                continue
            sources = list(reversed(value_node.value)) if isinstance(value_node, SequenceNode) else [value_node]
            for source in sources:
                if not isinstance(source, MappingNode):
                    raise self._invalid(source, "<< must be a mapping or a list of mappings")
                inner_merged, inner_own = self._pairs(source)
                merged += inner_merged + inner_own
        return merged, own

    def _scalar(self, node: yaml.Node) -> Scalar:
        if len(node.value) > MAX_SCALAR:
            raise self._invalid(node, f"a value must have at most {MAX_SCALAR} characters (got {len(node.value)})")
        if node.tag == _VALUE:
            return str(node.value)
        try:
            value: Scalar = self._loader.construct_object(node)
        except yaml.constructor.ConstructorError:
            raise self._invalid(node, f"the tag {shortened(str(node.tag))} is not supported") from None
        except (ValueError, OverflowError, TypeError, LookupError, AttributeError):
            raise self._invalid(node, f"{shortened(node.value)!r} is not valid for its YAML type") from None
        # the test of an abstract class is slow, and numbers and texts are most of a file
        if (isinstance(value, int) and value.bit_length() > 1024) or not isinstance(value, (str, float, Hashable)):
            raise self._invalid(node, "the number is too large")
        return value

    def _check_tag(self, node: yaml.Node, expected: str) -> None:
        if node.tag != expected:
            raise self._invalid(node, f"the tag {shortened(str(node.tag))} is not supported")

    def _invalid(self, node: yaml.Node, message: str) -> _UnsupportedYamlError:
        return _UnsupportedYamlError(problem=message, problem_mark=node.start_mark)
