import math
from dataclasses import astuple, replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cellwright.config.robot.model import link_poses
from cellwright.config.ur10 import GRIPPER, UR10
from cellwright.motion.chain import Chain, ChainJoint, chain_of
from cellwright.motion.joints import Joints
from cellwright.motion.kinematics import inverse
from cellwright.motion.solver import MAX_STEP, largest_step, travel
from cellwright.motion.ur_solver import UrSolver, ur_form
from cellwright.util.errors import UsageError
from cellwright.util.pose import Pose
from tests.config.robot.mjcf_robots import Moved, menagerie, quiet, with_small_meshes, write
from tests.motion.arms import UR_HOME, arm, error, robot, straight_paths, ur_chain, within
from tests.motion.ur_arms import UR_ARMS

UR5E = """
<compiler angle="radian"/>
<worldbody>
  <body name="base" pos="1 2 0.5" quat="0 0 0 -1"><geom size="0.1"/>
    <body name="shoulder" pos="0 0 0.1625"><joint name="pan" axis="0 0 1" range="-6.28 6.28"/><geom size="0.1"/>
      <body name="upper_arm" pos="0 0.138 0" quat="1 0 1 0">
        <joint name="lift" axis="0 1 0" range="-6.28 6.28"/><geom size="0.1"/>
        <body name="forearm" pos="0 -0.131 0.425">
          <joint name="elbow" axis="0 -1 0" range="-3.14 3.14"/><geom size="0.1"/>
          <body name="wrist1" pos="0 0 0.3922" quat="1 0 1 0">
            <joint name="w1" axis="0 1 0" ref="0.5"/><geom size="0.1"/>
            <body name="wrist2" pos="0 0.1263 0"><joint name="w2" axis="0 0 1" range="-6.28 6.28"/><geom size="0.1"/>
              <body name="wrist3" pos="0 0 0.0997"><joint name="w3" axis="0 1 0" range="-6.28 6.28"/><geom size="0.1"/>
                <body name="flange" pos="0 0.0996 0" quat="-1 1 0 0"><geom size="0.02"/></body>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </body>
</worldbody>
"""
UR5 = ur_chain(UR_ARMS["UR5"])
POSTURES = within(UR5, 2 * math.pi)


def solver_of(chain: Chain) -> UrSolver:
    form = ur_form(chain)
    assert form is not None
    return UrSolver(chain, form, UR_HOME)


def redrawn(chain: Chain, placed: Pose, flips: tuple[bool, ...], zeros: tuple[float, ...]) -> Chain:
    """Return the same arm as another file has it: elsewhere, with axes reversed, and with other zeros of angles."""
    # the axes, links and tool of the arm as it stands with all joints at `zeros`
    joints: list[ChainJoint] = []
    for place, joint in enumerate(chain.joints):
        before = Chain(chain.joints, Pose()).tool([*zeros[:place], *(0.0,) * (6 - place)])
        axis, point = placed.rotate(before.rotate(joint.axis)), placed.transform(before.transform(joint.point))
        sign = -1.0 if flips[place] else 1.0
        along = sign * 0.1 * place
        joints.append(
            replace(
                joint,
                axis=(sign * axis[0], sign * axis[1], sign * axis[2]),
                point=(point[0] + along * axis[0], point[1] + along * axis[1], point[2] + along * axis[2]),
            )
        )
    return Chain(tuple(joints), placed @ chain.tool(zeros))


@pytest.mark.parametrize("name", sorted(UR_ARMS))
def test_form_finds_published_lengths(name: str) -> None:
    form = ur_form(ur_chain(UR_ARMS[name]))
    assert form is not None
    published = replace(UR_ARMS[name], shoulder_offset=0.0, elbow_offset=0.0)
    for key in ("d1", "a2", "a3", "d4", "d5", "d6"):
        assert getattr(form.constants, key) == pytest.approx(getattr(published, key), abs=1e-12)


@given(
    st.tuples(*(st.booleans(),) * 6),
    st.tuples(*(st.floats(-3.0, 3.0),) * 6),
    st.tuples(*(st.floats(-1.0, 1.0),) * 3),
    st.tuples(*(st.floats(-3.0, 3.0),) * 3),
    within(UR5, 3.0),
)
@example((False,) * 6, (0.0,) * 6, (0.0,) * 3, (0.0, math.pi, 0.0), UR_HOME)
def test_frames_axes_and_zeros_of_a_file_do_not_matter(
    flips: tuple[bool, ...],
    zeros: tuple[float, ...],
    xyz: tuple[float, float, float],
    rpy: tuple[float, float, float],
    q: tuple[float, ...],
) -> None:
    chain = redrawn(UR5, Pose.from_rpy(xyz, rpy), flips, zeros)
    solver = solver_of(chain)
    found, drawn = solver.form.constants, UR_ARMS["UR5"]
    assert (found.a2, found.a3, found.d4, found.d5) == pytest.approx((drawn.a2, drawn.a3, drawn.d4, drawn.d5), abs=1e-3)
    target = chain.tool(q)
    postures = list(solver.branches(target, q))
    assert postures
    assert max(error(chain, each, target) for each in postures) < 1e-6


@given(POSTURES, POSTURES)
def test_branches_bring_tool_to_pose_within_limits_nearest_first(q: tuple[float, ...], near: tuple[float, ...]) -> None:
    solver = solver_of(UR5)
    target = UR5.tool(q)
    postures = list(solver.branches(target, near))
    assert 1 <= len(postures) <= 8
    assert max(error(UR5, each, target) for each in postures) < 1e-6
    for posture in postures:
        assert all(low <= each <= high for low, each, high in zip(solver.lower, posture, solver.upper, strict=True))
    distances = [travel(each, near, solver.speed) for each in postures]
    assert distances == sorted(distances)


def test_narrow_limits_leave_fewer_branches() -> None:
    target = UR5.tool(UR_HOME)
    wide = list(solver_of(UR5).branches(target, UR_HOME))
    narrow = list(solver_of(ur_chain(UR_ARMS["UR5"], 2.1)).branches(target, UR_HOME))
    assert len(narrow) < len(wide)
    assert narrow
    assert max(abs(value) for each in narrow for value in each) <= 2.1


def test_description_of_ur10_gives_postures_of_ur10_on_rail() -> None:
    chain = chain_of(UR10, GRIPPER, base="base_link")
    solver = solver_of(chain)
    near = (3.14, -1.13, 1.51, 3.77, -1.51, 0.0)
    target = Pose.from_rpy((-0.3, 0.2, 0.9), (0.0, 0.0, 0.4))
    world_T_base = Pose((0.3, 0.4, 1.0))
    expected = inverse(target, 0.4, near=Joints(0.4, *near))
    found = list(solver.branches(world_T_base.inverse() @ target, near))
    assert sorted(found) == [pytest.approx(each[1:], abs=1e-9) for each in sorted(expected)]


def test_free_wrist_3_stays() -> None:
    # wrist 2 at 0: wrists 1 and 3 turn about one axis
    q = (0.4, -1.2, 1.6, -0.5, 0.0, 0.9)
    assert next(solver_of(UR5).branches(UR5.tool(q), q)) == pytest.approx(q, abs=1e-6)


def test_pose_out_of_reach_has_no_branches() -> None:
    solver = solver_of(UR5)
    assert list(solver.branches(Pose((2.0, 0.0, 0.0)), UR_HOME)) == []
    assert solver.step_to(Pose((2.0, 0.0, 0.0)), UR_HOME) is None


def test_number_that_is_not_finite_is_refused() -> None:
    with pytest.raises(UsageError, match="finite"):
        next(solver_of(UR5).branches(Pose((math.nan, 0.0, 0.0)), UR_HOME))
    with pytest.raises(UsageError, match="finite"):
        next(solver_of(UR5).branches(Pose(), (math.inf, *UR_HOME[1:])))


@pytest.mark.parametrize("name", ["ur5", "ur10"])
def test_straight_paths_are_followed_without_jumps(name: str) -> None:
    chain, home = arm(name)
    solver, steps = solver_of(chain), 0
    for poses in straight_paths(chain, home):
        q = home
        for pose in poses:
            after = solver.step_to(pose, q)
            if after is None:
                continue
            assert largest_step(after, q) <= MAX_STEP
            assert error(chain, after, pose) < 1e-9
            q, steps = after, steps + 1
    assert steps >= 397


def test_step_never_jumps_to_another_branch() -> None:
    solver = solver_of(UR5)
    other = list(solver.branches(UR5.tool(UR_HOME), UR_HOME))[1]
    assert solver.step_to(UR5.tool(UR_HOME), other) == pytest.approx(other)
    far = tuple(each + 0.5 for each in UR_HOME)
    assert solver.step_to(UR5.tool(far), UR_HOME) is None


def test_arm_of_mjcf_is_recognised_by_its_axes(tmp_path: Path) -> None:
    # lengths of the UR5e; frames, a reversed elbow and a reference as no URDF has them
    file = write(tmp_path, UR5E)
    chain = chain_of(quiet(file).model, "flange", base="base")
    solver = solver_of(chain)
    found, published = astuple(solver.form.constants)[:6], astuple(UR_ARMS["UR5e"])[:6]
    assert found == pytest.approx(published, abs=1e-3)  # its file has a calibrated arm
    q = (0.3, -1.2, -1.6, -1.5, -1.3, 0.4)
    moved = Moved(file, dict(zip(solver.joints, q, strict=True)))
    world_T_base = Pose((1.0, 2.0, 0.5), (0.0, 0.0, 0.0, -1.0))
    assert (world_T_base @ chain.tool(q)).position == pytest.approx(moved.data.body("flange").xpos)
    assert next(solver.branches(chain.tool(q), q)) == pytest.approx(q)


def test_arm_of_menagerie_is_solved_in_closed_form(tmp_path: Path) -> None:
    file = with_small_meshes(menagerie("universal_robots_ur5e/ur5e.xml"), tmp_path)
    chain = chain_of(quiet(file).model, "attachment_site")
    solver = solver_of(chain)
    # its lengths are rounded to millimetres, and d4 is 134 mm
    lengths, published = solver.form.constants, UR_ARMS["UR5e"]
    assert (lengths.a2, lengths.a3, lengths.d4) == pytest.approx((published.a2, published.a3, published.d4), abs=1.5e-3)
    postures = list(solver.branches(chain.tool(UR_HOME), UR_HOME))
    assert postures[0] == pytest.approx(UR_HOME, abs=1e-6)
    assert max(error(chain, each, chain.tool(UR_HOME)) for each in postures) < 1e-6
    distances = [travel(each, UR_HOME, solver.speed) for each in postures]
    assert distances == sorted(distances)


def test_links_are_those_of_the_description() -> None:
    model = robot("ur5")
    solver = solver_of(chain_of(model, "tool0"))
    expected = link_poses(model, dict(zip(solver.joints, UR_HOME, strict=True)))
    for name, pose in solver.links(UR_HOME).items():
        assert pose.position == pytest.approx(expected[name].position)


@pytest.mark.parametrize("name", ["panda", "iiwa7", "xarm6", "xarm7"])
def test_other_arms_do_not_have_the_form(name: str) -> None:
    assert ur_form(arm(name).chain) is None


@pytest.mark.parametrize(
    ("place", "change"),
    [
        (1, {"point": (0.01, 0.0, 0.089159)}),  # axis 2 passes axis 1
        (4, {"point": (0.82725, 0.10915, 0.0)}),  # axis 5 passes axes 4 and 6
        (2, {"axis": (0.0, math.cos(0.01), math.sin(0.01))}),  # the elbow is not parallel
        (3, {"is_prismatic": True}),
    ],
)
def test_deviation_from_the_form_is_seen(place: int, change: dict[str, Any]) -> None:
    joints = list(UR5.joints)
    assert ur_form(Chain(tuple(joints), UR5.base_T_tool)) is not None
    joints[place] = replace(joints[place], **change)
    assert ur_form(Chain(tuple(joints), UR5.base_T_tool)) is None
