from pathlib import Path

import hypothesis.strategies as st
import pytest
from hypothesis import given, settings

from cellwright.config.robot.mjcf import MjcfRobot, read_mjcf
from cellwright.config.robot.model import JointType, Limits
from cellwright.util.errors import DescriptionError
from cellwright.util.pose import Pose
from tests.config.robot.mjcf_robots import Moved, assert_moves_as_the_engine, menagerie, quiet, with_small_meshes, write

UR5E = "universal_robots_ur5e/ur5e.xml"
ARM = ("shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint")
GEOM = '<geom size="0.1"/>'
NUMBERS = st.floats(-2, 2).map(lambda number: round(number, 3))
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


def text(numbers: tuple[float, ...]) -> str:
    return " ".join(map(str, numbers))


@pytest.fixture(scope="module")
def ur5e_file(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return with_small_meshes(menagerie(UR5E), tmp_path_factory.mktemp("ur5e"))


@pytest.fixture(scope="module")
def ur5e(ur5e_file: Path) -> MjcfRobot:
    return read_mjcf(ur5e_file, warn=pytest.fail)


@pytest.fixture(scope="module")
def engine(ur5e_file: Path) -> Moved:
    return Moved(ur5e_file, {})


@given(positions=st.tuples(*[st.floats(-3.1, 3.1)] * 6))
@settings(max_examples=50)
def test_ur5e_moves_as_in_the_engine(ur5e: MjcfRobot, engine: Moved, positions: tuple[float, ...]) -> None:
    assert_moves_as_the_engine(ur5e, engine, dict(zip(ARM, positions, strict=True)))


def test_ur5e_has_names_limits_and_gains_of_its_file(ur5e: MjcfRobot) -> None:
    assert (ur5e.model.name, ur5e.model.root, ur5e.sites) == ("ur5e", "base", ("attachment_site",))
    assert tuple(joint.name for joint in ur5e.model.driven) == ARM
    assert ur5e.model.joint("elbow_joint").limits == Limits(-3.1415, 3.1415, effort=150.0)
    assert ur5e.model.joint("wrist_1_joint").limits.effort == 28.0
    assert [(drive.kp, drive.kv) for drive in ur5e.drives.values()] == [(2000.0, 400.0)] * 3 + [(500.0, 100.0)] * 3
    assert {each.armature for each in ur5e.dynamics.values()} == {0.1}
    assert list(ur5e.home.items()) == list(zip(ARM, (-1.5708, -1.5708, 1.5708, -1.5708, -1.5708, 0.0), strict=True))
    assert ur5e.world_T_root == Pose(quaternion=(0.0, 0.0, 0.0, -1.0))


def test_ur5e_is_drawn_by_meshes_and_touched_by_capsules(ur5e: MjcfRobot) -> None:
    shapes = ur5e.model.links["forearm_link"].shapes
    assert [(shape.kind, shape.is_seen, shape.is_touched) for shape in shapes] == [
        *[("mesh", True, False)] * 4,
        *[("capsule", False, True)] * 2,
    ]
    assert shapes[0].colour == (0.49, 0.678, 0.8, 1.0)
    assert shapes[4].size == (0.055, 0.12, 0.0)


@pytest.mark.slow
def test_ur5e_with_its_own_meshes_reads_alike(ur5e: MjcfRobot) -> None:
    whole = read_mjcf(menagerie(UR5E), warn=pytest.fail)
    assert (whole.model.joints, whole.drives, whole.home) == (ur5e.model.joints, ur5e.drives, ur5e.home)


@st.composite
def robots(draw: st.DrawFn) -> tuple[str, list[str]]:
    """Return the content of an MJCF file, and its joints: chains and trees with everything that moves frames."""
    names: list[str] = []

    def body(number: int, inside: str) -> str:
        joints = ""
        for kind in draw(st.lists(st.sampled_from(("hinge", "slide")), max_size=3)):
            names.append(f"j{len(names)}")
            axis = draw(VECTORS.filter(lambda vector: max(map(abs, vector)) > 0.1))
            joints += (
                f'<joint name="{names[-1]}" type="{kind}" axis="{text(axis)}" pos="{text(draw(VECTORS))}" '
                f'ref="{draw(NUMBERS)}"/>'
            )
        place = f'pos="{text(draw(VECTORS))}" euler="{text(draw(VECTORS))}"'
        own = f'{joints}<geom type="box" size=".1 .2 .3" pos="{text(draw(VECTORS))}" euler="{text(draw(VECTORS))}"/>'
        framed = f'<frame pos="0 1 0" euler="1 0 0"><site name="s{number}" pos="1 2 3"/>{inside}</frame>'
        return f'<body name="b{number}" {place}>{own}{framed}</body>'

    inside = ""
    for number in range(draw(st.integers(1, 4))):
        inside = body(number, inside) if draw(st.booleans()) else inside + body(number, "")
    angle = draw(st.sampled_from(("radian", "degree")))
    return f'<compiler angle="{angle}"/><worldbody>{inside}</worldbody>', names


@given(robot=robots(), data=st.data())
@settings(max_examples=40)
def test_any_tree_of_bodies_moves_as_in_the_engine(
    tmp_path_factory: pytest.TempPathFactory, robot: tuple[str, list[str]], data: st.DataObject
) -> None:
    inside, names = robot
    path = write(tmp_path_factory.mktemp("robot"), inside)
    positions = {name: data.draw(NUMBERS) for name in names}
    found = quiet(path)
    assert sorted(joint.name for joint in found.model.driven) == sorted(names)
    assert_moves_as_the_engine(found, Moved(path, positions), positions)


def test_several_joints_of_a_body_have_empty_links_between_them(tmp_path: Path) -> None:
    joints = '<joint name="x" pos="1 0 0"/><joint name="y" pos="0 1 0" axis="0 1 0"/>'
    found = quiet(write(tmp_path, f'<worldbody><body name="a"><body name="b">{joints}{GEOM}</body></body></worldbody>'))
    assert [(joint.parent, joint.child) for joint in found.model.joints] == [("a", "x_link"), ("x_link", "b")]
    assert found.model.links["x_link"].inertial is None
    assert found.model.joints[1].origin.position == (-1.0, 1.0, 0.0)
    assert found.model.links["b"].shapes[0].pose.position == (0.0, -1.0, 0.0)


def test_types_of_joints_follow_their_limits(tmp_path: Path) -> None:
    joints = (
        '<joint name="a" axis="1 0 0"/><joint name="b" range="-90 90"/><joint name="c" type="slide"/>'
        '<joint name="d" type="slide" range="0 .5"/>'
    )
    inside = f'<worldbody><body name="base"><body>{joints}{GEOM}</body><body><joint type="ball"/>{GEOM}</body></body>'
    found = quiet(write(tmp_path, f"{inside}</worldbody>")).model.joints
    assert [joint.type for joint in found] == [
        JointType.CONTINUOUS,
        JointType.REVOLUTE,
        *[JointType.PRISMATIC] * 2,
        JointType.SPHERICAL,
    ]
    assert found[1].limits.upper == pytest.approx(1.5707963, abs=1e-6)
    assert (found[2].limits, found[3].limits) == (Limits(), Limits(0.0, 0.5))


def test_names_that_the_file_lacks_are_made(tmp_path: Path) -> None:
    inside = (
        f'<body name="base"><site name="arm"/><body name="arm"><joint/>{GEOM}<site/><body>{GEOM}</body></body></body>'
    )
    found = quiet(write(tmp_path, f"<worldbody>{inside}</worldbody>"))
    assert list(found.model.links) == ["base", "arm_site", "arm", "body_3"]
    assert [joint.name for joint in found.model.joints] == ["arm_site_joint", "arm_joint", "body_3_joint"]
    assert found.sites == ("arm_site",)


def test_a_free_root_stands_where_the_file_puts_it(tmp_path: Path) -> None:
    lines: list[str] = []
    inside = f'<geom type="plane" size="1 1 1"/><body name="torso" pos="0 0 1.2"><freejoint/>{GEOM}</body>'
    found = read_mjcf(write(tmp_path, f"<worldbody>\n{inside}</worldbody>"), warn=lines.append)
    assert (found.model.root, found.world_T_root.position, found.model.joints) == ("torso", (0.0, 0.0, 1.2), ())
    assert lines == [
        f"{tmp_path}/arm.xml:3: geom: shapes of the world are no part of the robot, and are left out",
        f"{tmp_path}/arm.xml:3: freejoint: the root is placed where the robot stands; its free joint is left out",
    ]


def test_a_moving_root_and_several_roots_stand_on_the_world(tmp_path: Path) -> None:
    rail = f'<worldbody><body name="cart" pos="1 0 0"><joint name="rail" type="slide"/>{GEOM}</body></worldbody>'
    found = quiet(write(tmp_path, rail))
    assert (found.model.root, found.model.joints[0].origin.position) == ("world", (1.0, 0.0, 0.0))
    two = f'<worldbody><body name="left">{GEOM}</body><body name="right">{GEOM}</body></worldbody>'
    assert [joint.parent for joint in quiet(write(tmp_path, two)).model.joints] == ["world", "world"]


@pytest.mark.parametrize(
    ("inside", "why"),
    [
        ("<worldbody/>", r"the file has no bodies; add the robot's to <worldbody>"),
        (
            f'<worldbody><body/>\n<body><joint type="free" name="f"/>{GEOM}</body></worldbody>',
            r"arm\.xml:3: joint\[f\]: a free joint below the root; give the robot one outermost body",
        ),
    ],
)
def test_what_no_tree_holds_is_refused(tmp_path: Path, inside: str, why: str) -> None:
    with pytest.raises(DescriptionError, match=why):
        quiet(write(tmp_path, inside))
