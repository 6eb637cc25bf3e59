"""YAML as PyYAML reads it, with places, and with bounds that stop all bombs."""

import contextlib
from pathlib import Path

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from cellwright.config.parsing import yaml_source
from cellwright.config.parsing.overrides import read_values
from cellwright.config.parsing.sources import MAX_BYTES, JoinedText, Text, read_texts
from cellwright.config.parsing.tree import Items, Leaf, Problems, Table, YamlNode
from cellwright.config.parsing.yaml_source import MAX_NODES, parse
from cellwright.util.errors import DescriptionError, UsageError


def parsed(*contents: str) -> tuple[YamlNode | None, Problems]:
    problems = Problems()
    texts = [Text(f"{letter}.yaml", content) for letter, content in zip("abcdef", contents, strict=False)]
    return parse(JoinedText(texts), problems), problems


def plain(node: YamlNode | None) -> object:
    match node:
        case Table():
            return {entry.name: plain(entry.value) for entry in node.entries.values()}
        case Items():
            return [plain(item) for item in node.items]
        case Leaf():
            return node.value
    return None


def refusal(*contents: str) -> str:
    with pytest.raises(DescriptionError) as caught:
        parsed(*contents)
    return str(caught.value)


ODD = """
yes: no
octal: 010
time: 1:30
exponent: 1e3
point: 1.e+3
half: .5
text: '5'
nothing:
date: 2017-05-01
base: &base {a: 1, b: 2}
derived: {<<: *base, b: 3}
both: {<<: [{x: 1}, {x: 2, y: 3}]}
list: [*base, [], {}]
=: equals
2: two
2.0: also two
"""


def test_odd_yaml_equals_pyyaml() -> None:
    assert plain(parsed(ODD)[0]) == yaml.safe_load(ODD)
    assert [str(w) for w in parsed(ODD)[1].warnings] == [
        "a.yaml:17: 2.0: duplicate key (first at a.yaml:16); this one is used"
    ]


scalars = st.one_of(
    st.none(), st.booleans(), st.integers(-(2**60), 2**60), st.floats(allow_nan=False), st.text(max_size=9)
)
trees = st.recursive(
    scalars,
    lambda inner: st.one_of(st.lists(inner, max_size=4), st.dictionaries(scalars, inner, max_size=4)),
    max_leaves=20,
)


@pytest.mark.slow
@given(trees)
def test_any_document_equals_pyyaml(document: object) -> None:
    text = yaml.safe_dump(document)
    assert plain(parsed(text)[0]) == yaml.safe_load(text)


@given(st.lists(st.integers(0, 4), min_size=1, max_size=6), st.data())
def test_joined_files_keep_file_and_line(sizes: list[int], data: st.DataObject) -> None:
    ends = st.sampled_from(["\n", "\r\n", "\r", "\n# remark\n", "\n\n"])
    contents, where, number = [], {}, 0
    for file, size in enumerate(sizes):
        content = ""
        for _ in range(size):
            line = 1 + content.count("\n") + content.count("\r") - content.count("\r\n")
            where[f"key{number}"] = ("abcdef"[file] + ".yaml", line)
            content += f"key{number}: {number}" + data.draw(ends)
            number += 1
        contents.append(content)
    root, _ = parsed(*contents)
    found = (
        {str(e.name): (e.place.path, e.place.line) for e in root.entries.values()} if isinstance(root, Table) else {}
    )
    assert found == where


def test_duplicate_key_in_second_file_wins_with_warning() -> None:
    root, problems = parsed("orders: 1\n", "# second\norders: 2\n")
    assert plain(root) == {"orders": 2}
    assert [str(w) for w in problems.warnings] == ["b.yaml:2: orders: replaces the entry of a.yaml:1"]


def test_merged_key_is_overridden_without_warning() -> None:
    assert not parsed("a: &a {x: 1}\nb: {<<: *a, x: 2}")[1].warnings


def test_missing_line_end_before_next_file_is_explained() -> None:
    message = refusal("time_limit: -1", "arm: {type: ur10}\n")
    assert message.startswith("b.yaml:1: invalid YAML")
    assert "the last line of a.yaml has no line end" in message


def test_nodes_have_dotted_keys_and_lines() -> None:
    root, _ = parsed("a:\n  b:\n    - 1\n    - c: 2\n")
    assert isinstance(root, Table)
    a = root.get("a")
    assert isinstance(a, Table)
    assert (a.key, a.place.line) == ("a", 1)
    b = a.get("b")
    assert isinstance(b, Items)
    assert [item.key for item in b.items] == ["a.b[0]", "a.b[1]"]
    assert [item.place.line for item in b.items] == [3, 4]


BOMB = "a0: &a0 [1, 1]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}, *a{i - 1}]\n" for i in range(1, 60))
MERGE_BOMB = "a0: &a0 {x: 1}\n" + "".join(f"a{i}: &a{i} {{<<: [*a{i - 1}, *a{i - 1}]}}\n" for i in range(1, 60))
LADDER = "a0: &a0 [1]\n" + "".join(f"a{i}: &a{i} [*a{i - 1}]\n" for i in range(1, 60))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BOMB, "more than 50000 values"),
        (MERGE_BOMB, "more than 50000 values"),
        (LADDER, "nested deeper than 50 levels"),
        ("[" * 10_000, "nested deeper than 50 levels"),
        ("- " * 10_000, "nested deeper than 50 levels"),
        ("a: &a [*a]", "an anchor contains itself"),
        ("a: &a {b: *a}", "an anchor contains itself"),
        ("a: &a {<<: *a}", "an anchor contains itself"),
        ("a: *b", "undefined alias"),
        ("a: !!python/object/apply:os.system [x]", "the tag"),
        ("a: !thing {}", "the tag"),
        ("a: !thing []", "the tag"),
        ("a: !thing x", "the tag"),
        ("a: !!int ''", "is not valid for its YAML type"),
        ("a: !!bool maybe", "is not valid for its YAML type"),
        ("a: !!timestamp noon", "is not valid for its YAML type"),
        ("a: 2017-13-45", "is not valid for its YAML type"),
        ("a: 1" + "0" * 5000, "is not valid for its YAML type"),
        ("a: 0x" + "f" * 5000, "too large"),
        ("a: " + "x" * 20_000, "at most 10000"),
        ("a:\n\tb: 1", "tabs are not allowed here; use spaces"),
        ("a: 1\n---\nb: 2", "a second document starts here"),
        ("a: \0", "invalid character"),
        ("<<: 3", "<< must be a mapping"),
        ("{[1]: 2}", "cannot be a key"),
        ("a: 1\n b: 2", "invalid YAML"),
        ("a: 'x", "invalid YAML"),
        ("%YAML 9", "invalid YAML"),
    ],
)
def test_invalid_yaml_is_refused_with_place(text: str, message: str) -> None:
    refused = refusal(text)
    assert refused.startswith("a.yaml:")
    assert message in refused


@given(st.text(max_size=200))
def test_any_text_is_read_or_refused(text: str) -> None:
    with contextlib.suppress(DescriptionError):
        parsed(text)


@pytest.mark.slow
@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, data: bytes) -> None:
    path = tmp_path_factory.getbasetemp() / "bytes.yaml"
    path.write_bytes(data)
    with contextlib.suppress(DescriptionError):
        parse(read_texts([path]), Problems())


def test_unreadable_files_are_refused_together(tmp_path: Path) -> None:
    latin, large = tmp_path / "latin.yaml", tmp_path / "large.yaml"
    latin.write_bytes(b"# fine\n# caf\xe9\n")
    large.write_bytes(b"#" * (MAX_BYTES + 1))
    with pytest.raises(DescriptionError) as caught:
        read_texts([tmp_path / "none.yaml", tmp_path, latin, large])
    assert [str(problem) for problem in caught.value.problems] == [
        f"{tmp_path}/none.yaml: cannot be read: No such file or directory",
        f"{tmp_path}: cannot be read: Is a directory",
        f"{latin}:2: not UTF-8 text; save the file as UTF-8",
        f"{large}: the configuration exceeds 512 KiB in total",
    ]


def test_byte_order_marks_are_accepted(tmp_path: Path) -> None:
    path = tmp_path / "a.yaml"
    for encoding in ("utf-8-sig", "utf-16"):
        path.write_text("a: 1\n", encoding=encoding)
        assert plain(parse(read_texts([path]), Problems())) == {"a": 1}


def test_text_longer_than_files_may_be_is_refused_before_it_is_parsed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(yaml_source, "_Composer", None)  # it would fail
    assert refusal("a: 1\n" * (MAX_BYTES // 5 + 1)) == "a.yaml:1: more than 512 KiB of text"
    with pytest.raises(UsageError, match="--sweep: more than 512 KiB of text"):
        read_values("--sweep", "1," * (MAX_BYTES // 2) + "1")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("head", "item", "line"), [("a:\n", "- 1\n", MAX_NODES - 1), ("", "? a\n", MAX_NODES // 2 + 1)]
)
def test_values_are_counted_while_they_are_parsed(head: str, item: str, line: int) -> None:
    assert refusal(head + item * 100_000) == f"a.yaml:{line}: more than {MAX_NODES} values; each use of an alias counts"
