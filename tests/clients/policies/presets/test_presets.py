"""Presets of key maps: what policies of common robots see and command, and the cells that they do not fit."""

import numpy as np
import pytest

from cellwright import load_robot, load_trial
from cellwright.clients.policies.cell_workplace import cell_names
from cellwright.clients.policies.key_map import Cell, Grip, KeyMap, Picture, ToChannels, ToGripper, ToolPose, ToTool
from cellwright.clients.policies.map_reader import load_map
from cellwright.clients.policies.presets import map_path, preset_names
from cellwright.clients.policies.robot_workplace import robot_names
from cellwright.clients.policies.targets import Targets
from cellwright.config.control import Channel, ControlSpace
from cellwright.util.errors import DescriptionError, UnknownNameError

TICK, TWO_CAMERAS = (1, 500), ("table", "wrist")


def joints(names: str, arm: str = "") -> list[Channel]:
    prefix = f"{arm}/" if arm else ""
    return [Channel(f"{prefix}{each}", "joint", "rad", -3.0, 3.0, each, arm) for each in names]


def width(arm: str = "") -> Channel:
    return Channel(f"{arm}/width" if arm else "width", "width", "m", 0.0, 0.08, "", arm)


ONE_ARM = ControlSpace((*joints("abcdefg"), width()))
TWO_ARMS = ControlSpace(tuple(each for arm in ("left", "right") for each in (*joints("abcdef", arm), width(arm))))
DROID = Cell(ONE_ARM, TWO_CAMERAS, {"arm": ONE_ARM.names[:7]}, (1, 240), {"arm": "width"})
ALOHA = Cell(
    TWO_ARMS,
    ("high",),
    {"left": TWO_ARMS.names[:6], "right": TWO_ARMS.names[7:13]},
    TICK,
    {"left": "left/width", "right": "right/width"},
)


def preset(name: str, cell: Cell) -> KeyMap:
    return load_map(map_path(name), cell)


def refusal(name: str, cell: Cell) -> str:
    with pytest.raises(DescriptionError) as caught:
        preset(name, cell)
    return str(caught.value)


def test_names_are_known_and_others_are_files() -> None:
    assert preset_names() == ["aloha", "droid", "libero"]
    assert str(map_path("my_map.yaml")) == "my_map.yaml"
    with pytest.raises(UnknownNameError, match="unknown policy map 'driod'; did you mean droid"):
        map_path("driod")


def test_droid_moves_joints_by_velocities_at_fifteen_hertz() -> None:
    found = preset("droid", DROID)
    assert (found.rate, found.chunk, found.size) == (15.0, 8, 8)
    assert found.observation["observation/wrist_image_left"] == Picture("wrist", (224, 224))
    assert found.observation["observation/gripper_position"] == Grip("width")
    targets = Targets(found, ONE_ARM, {})
    targets.begin([0.0] * 7 + [0.08])
    action = np.array([1.0, -2.0, 0.5, 0.0, 0.0, 0.0, 0.0, 0.6])
    assert targets.take(action) == pytest.approx([0.2, -0.2, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0])


def test_droid_is_refused_where_its_period_is_no_whole_number_of_ticks() -> None:
    text = refusal("droid", Cell(ONE_ARM, TWO_CAMERAS, DROID.arms, TICK, DROID.grippers_of_arms))
    assert "presets/droid.yaml:3: rate: a period must be whole ticks of 2 ms (got 15 Hz)" in text
    assert "take 15.1515 or 14.7059 (or a round 20 or 12.5)" in text


def test_droid_is_refused_without_seven_joints_and_a_second_camera() -> None:
    text = refusal("droid", robot_names(load_robot("tandem"), (1, 240)))
    assert "the arm right must have 7 joints (got 6: right_shoulder_pitch, " in text
    assert "no camera 1 here; there is none" in text


def test_aloha_commands_left_before_right_and_grippers_by_shares() -> None:
    found = preset("aloha", ALOHA)
    assert (found.rate, found.chunk, found.size) == (50.0, 10, 14)
    assert found.observation["images"] == {"cam_high": Picture("high", (224, 224), is_planar=True)}
    state = found.observation["state"]
    assert isinstance(state, tuple)
    assert state[1] == Grip("left/width", (1.0,), (0.0,))
    targets = Targets(found, TWO_ARMS, {})
    targets.begin([0.0] * 14)
    values = targets.take(np.array([0.1] * 6 + [0.25] + [0.2] * 6 + [1.5]))
    assert values == pytest.approx([0.1] * 6 + [0.02] + [0.2] * 6 + [0.08])


def test_aloha_fits_a_robot_whose_node_takes_fifty_hertz() -> None:
    robot = load_robot("tandem")
    names = robot_names(robot, (1, 500))
    found = preset("aloha", Cell(names.space, ("head",), names.arms, names.timestep, names.grippers_of_arms))
    assert found.actions[1] == ToGripper("gripper_left", ends=(1.0, 0.0))
    assert "a round 60 or 48" in refusal("aloha", robot_names(robot, (1, 240)))


def test_libero_moves_the_tool_and_sees_mirrored_pictures() -> None:
    trial = load_trial("lesson")
    names = cell_names(trial)
    found = preset("libero", Cell(names.space, TWO_CAMERAS, names.arms, names.timestep, names.grippers_of_arms))
    assert (found.rate, found.chunk, found.size) == (20.0, 5, 7)
    assert found.observation["observation/image"] == Picture("table", (224, 224), mirrored=True)
    assert found.observation["observation/state"] == (
        ToolPose("arm", "axis_angle", "world"),
        Grip("suction", (0.04, -0.04), (0.0, 0.0)),
    )
    step = ToTool("arm", "axis_angle", steps=True, frame="world", scale=0.05, turn_scale=0.5, limit=1.0)
    assert found.actions == (step, ToGripper("suction", 0.0))
    assert "no camera 1 here; there is none" in refusal("libero", names)


def test_limit_clips_each_number_before_it_is_scaled() -> None:
    targets = Targets(KeyMap({}, (ToChannels(("a",), scale=2.0, limit=0.5),)), ControlSpace(tuple(joints("a"))), {})
    assert targets.take(np.array([9.0])) == [1.0]
