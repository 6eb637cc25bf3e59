"""Names in a key map: by themselves, by their places, and by the arms that they belong to."""

import pytest

from cellwright.clients.policies.key_map import Cell
from cellwright.clients.policies.map_names import channels, is_beyond, named
from cellwright.config.control import Channel, ControlSpace
from cellwright.config.parsing.reader import Reader
from cellwright.config.parsing.sources import JoinedText, Text
from cellwright.config.parsing.tree import Problems, YamlNode
from cellwright.config.parsing.yaml_source import parse_mapping

SPACE = ControlSpace(tuple(Channel(name, "joint", "rad", -1.0, 1.0) for name in "abc"))
CELL = Cell(SPACE, ("eye", "2"), {"arm": ("a", "b")}, (1, 500))


def node(text: str) -> YamlNode:
    found = parse_mapping(JoinedText([Text("map", f"x: {text}")]), Problems(), "a map").get("x")
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("text", "name"), [("eye", "eye"), ("1", "eye"), ("2", "2"), ("alias", "eye"), ("3", None), ("0", None)]
)
def test_name_or_place_or_alias(text: str, name: str | None) -> None:
    problems = Problems()
    assert named(CELL.cameras, "camera", {"alias": "eye"})(Reader(problems), node(text)) == name
    assert bool(problems.errors) == (name is None)


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("all", ("a", "b", "c")),
        ("[c, a]", ("c", "a")),
        ("{arm: 1}", ("a", "b")),
        ("{arm: arm, count: 2}", ("a", "b")),
        ("{arm: arm, count: 3}", None),
        ("{arm: 2}", None),
        ("{count: 2}", None),
        ("[]", None),
    ],
)
def test_channels_by_names_or_by_their_arm(text: str, names: tuple[str, ...] | None) -> None:
    problems = Problems()
    assert channels(CELL)(Reader(problems), node(text)) == names
    assert bool(problems.errors) == (names is None)


def test_place_beyond_the_last_is_known_as_such() -> None:
    assert is_beyond(node("3"), CELL.cameras)
    assert not is_beyond(node("1"), CELL.cameras)
    assert not is_beyond(node("wrist"), CELL.cameras)
    assert not is_beyond(None, CELL.cameras)
