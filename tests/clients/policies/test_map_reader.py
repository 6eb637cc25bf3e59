"""Key maps as files: what they say, and each fault with its line, against the names of a cell."""

from pathlib import Path

import pytest

from cellwright import load_trial
from cellwright.clients.policies.dialects import DIALECT_NAMES
from cellwright.clients.policies.key_map import (
    Cell,
    Channels,
    Constant,
    KeyMap,
    Picture,
    Skip,
    ToChannels,
    ToGripper,
    ToolPose,
    ToTool,
    Words,
    default_map,
)
from cellwright.clients.policies.map_reader import load_map, map_of_text
from cellwright.config.control import ControlSpace
from cellwright.util.errors import DescriptionError

SPACE = ControlSpace.of(load_trial("lesson"))
CELL = Cell(SPACE, ("overhead", "wrist"), {"arm": SPACE.names[:7]}, (1, 500), {"arm": "suction"})

LIBERO = """\
rate: 20
chunk: 5
stale: play
dialect: openpi
observation:
  observation/image: {camera: overhead, size: [224, 224], turned: true}
  observation/state:
    - {pose: arm, rotation: axis_angle, frame: world}
    - {channels: [suction]}
    - {constant: 0}
  images:
    wrist: {camera: wrist, planar: true}
  prompt: {text: 'Task: {sentence}'}
actions:
  - {pose: arm, mode: delta, rotation: axis_angle, frame: world, scale: 0.05, turn_scale: 0.5}
  - {gripper: suction, threshold: 0, closes: above}
  - {skip: 1}
"""


def load(text: str, folder: Path) -> KeyMap:
    file = folder / "map.yaml"
    file.write_text(text)
    return load_map(file, CELL)


def test_map_says_where_each_entry_comes_from_and_what_each_number_commands(tmp_path: Path) -> None:
    found = load(LIBERO, tmp_path)
    assert found.observation == {
        "observation/image": Picture("overhead", (224, 224), turned=True),
        "observation/state": (ToolPose("arm", "axis_angle", "world"), Channels(("suction",)), Constant((0.0,))),
        "images": {"wrist": Picture("wrist", is_planar=True)},
        "prompt": Words("Task: {sentence}"),
    }
    tool = ToTool("arm", "axis_angle", steps=True, frame="world", scale=0.05, turn_scale=0.5)
    assert found.actions == (tool, ToGripper("suction", 0.0), Skip(1))
    assert (found.size, found.rate, found.chunk, found.drops_stale, found.dialect) == (8, 20.0, 5, False, "openpi")
    assert found.cameras == ("overhead", "wrist")


def test_map_in_a_recording_is_the_map_of_the_file(tmp_path: Path) -> None:
    found = load(LIBERO, tmp_path)
    assert map_of_text(found.text, CELL) == found


def test_all_channels_have_a_word(tmp_path: Path) -> None:
    found = load("observation: {state: {channels: all}}\nactions: [{channels: all}]\n", tmp_path)
    assert found.actions == (ToChannels(SPACE.names),)
    assert (found.rate, found.chunk, found.drops_stale) == (20.0, None, None)


def test_without_a_map_the_policy_uses_the_names_of_the_cell() -> None:
    found = default_map(CELL)
    assert found.observation["state"] == Channels(SPACE.names)
    assert found.observation["images"] == {name: Picture(name, (224, 224)) for name in ("overhead", "wrist")}
    assert found.size == 8


BASE = "observation: {state: {channels: all}}\nactions: [{channels: all}]\n"


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("observation:\n  a: {camera: overhed}\n", "2: observation.a.camera: unknown camera 'overhed'; did you mean"),
        ("observation:\n  a: {channels: [elbow_join]}\n", "2: observation.a.channels[0]: unknown channel 'elbow_join'"),
        (
            "observation:\n  a: {cemera: wrist}\n",
            "2: observation.a: must have one of channels, gripper, pose, constant, camera",
        ),
        ("observation:\n  a: {camera: wrist, size: 224}\n", "must be a list of width and height"),
        ("observation:\n  a: {camera: wrist, size: [0, 224]}\n", "must be from 1 to 4096 px (got 0)"),
        ("observation:\n  a: {camera: wrist, flip: true}\n", "2: observation.a.flip: unknown entry"),
        ("observation:\n  a: [{camera: wrist}]\n", "must be a list of sources of numbers"),
        ("observation:\n  a: {text: 5}\n", "must be a text"),
        ("observation: {}\n", "1: observation: must have an entry"),
        ("observation: 5\n", "must be a mapping"),
        ("actions: []\n", "must be a list of parts"),
        ("actions:\n  - {gripper: elbow_joint}\n", "unknown gripper 'elbow_joint'"),
        ("actions:\n  - {pose: arm2}\n", "unknown arm 'arm2'"),
        ("actions:\n  - {pose: arm, frame: tool}\n", "frame: tool needs mode: delta"),
        ("actions:\n  - {pose: arm, rotation: euler}\n", "unknown form of rotations 'euler'"),
        ("actions:\n  - {channels: [suction]}\n  - {gripper: suction}\n", "suction has two parts"),
        ("actions:\n  - {skip: 3}\n", "no part commands anything"),
        ("actions:\n  - {channels: all, mode: relative}\n", "must be absolute or delta"),
        ("rate: 30\n", "1: rate: a period must be whole ticks of 2 ms (got 30 Hz); take 31.25 or 29.4118"),
        ("rate: 15\n", "take 15.1515 or 14.7059 (or a round 20 or 12.5)"),
        ("observation:\n  a: {camera: 3}\n", "no camera 3 here; there are 2: overhead, wrist"),
        ("observation:\n  a: {gripper: arm, open: [1, 2]}\n", "open and closed must have equally many numbers"),
        ("observation:\n  a: {channels: {arm: arm, count: 6}}\n", "the arm arm must have 6 joints (got 7: linear_arm"),
        ("actions:\n  - {gripper: arm, open: 1}\n", "give two different numbers, open and closed, or threshold"),
        ("actions:\n  - {gripper: arm, open: 1, closed: 0, threshold: 0}\n", "give two different numbers"),
        ("actions:\n  - {channels: all, limit: 0}\n", "must be above 0 (got 0)"),
        ("chunk: 0\n", "must be from 1 to 10000"),
        ("stale: keep\n", "must be drop or play"),
        ("horizon: 8\n", "1: horizon: unknown entry"),
    ],
)
def test_fault_is_reported_with_its_line(text: str, error: str, tmp_path: Path) -> None:
    rest = "\n".join(line for line in BASE.splitlines() if not text.startswith(line.partition(":")[0] + ":"))
    with pytest.raises(DescriptionError) as caught:
        load(f"{text}{rest}\n", tmp_path)
    assert f"{tmp_path}/map.yaml:" in str(caught.value)
    assert error in str(caught.value)


def test_missing_section_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match="'actions' is missing"):
        load("observation: {state: {channels: all}}\n", tmp_path)


def test_missing_file_is_an_error(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match=r"none\.yaml: cannot be read"):
        load_map(tmp_path / "none.yaml", CELL)


@pytest.mark.parametrize("dialect", DIALECT_NAMES)
def test_dialect_of_any_wire_is_taken(dialect: str, tmp_path: Path) -> None:
    assert load(f"dialect: {dialect}\n{BASE}", tmp_path).dialect == dialect
