"""The agent's part figures, against the parts themselves."""

import math
from typing import Any

import mujoco
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.model.parts import PART_TYPES as BUILT
from cellwright.cell.model.parts import add_part, add_part_meshes, part_type
from cellwright.clients.agents.kitter.part_figures import Catalogue, Disc, PartFigures, box_outline
from cellwright.config.footprints import PART_TYPES
from cellwright.engine.shapes import Visuals, bounds
from cellwright.util.errors import UnknownNameError
from cellwright.util.pose import Pose

figures = Catalogue().figures


def test_catalogue_has_every_buildable_type() -> None:
    assert frozenset(BUILT) == PART_TYPES


@pytest.mark.parametrize("name", sorted(PART_TYPES))
def test_part_outline_covers_part(name: str) -> None:
    lower, upper = part_type(name).box
    discs = figures(name).outline
    assert min(disc.x - disc.radius for disc in discs) <= lower[0] + 1e-4
    assert max(disc.x + disc.radius for disc in discs) >= upper[0] - 1e-4
    assert min(disc.y - disc.radius for disc in discs) <= lower[1] + 1e-4
    assert max(disc.y + disc.radius for disc in discs) >= upper[1] - 1e-4


@pytest.mark.parametrize("name", sorted(PART_TYPES))
def test_grip_points_lie_over_solid_top(name: str) -> None:
    figure = figures(name)
    for grip in (figure.grip, *figure.other_grips):
        tops = []
        for shape in part_type(name).solid:
            lower, upper = bounds((shape,))
            nearest = [min(max(at, low), high) for at, low, high in zip(grip, lower[:2], upper[:2], strict=True)]
            if math.dist(nearest, grip) < 0.038:  # radius of the cup's face
                tops.append(upper[2])
        assert max(tops) == pytest.approx(figure.top, abs=0.0006)


def test_outline_moves_with_part() -> None:
    (far,) = [
        disc
        for disc in figures("gasket_part").covers(Pose.from_rpy((1.0, 2.0, 0.0), (0.0, 0.0, math.pi / 2)))
        if disc.y > 2.05
    ]
    assert (far.x, far.y) == pytest.approx((1.0, 2.067))


def test_box_outline_covers_corners() -> None:
    discs = box_outline(0.06, 0.13, 0.03, 0.03, 0.9)
    for u in (-0.03, 0.03):
        for v in (-0.065, 0.065):
            x = 0.03 + math.cos(0.9) * u - math.sin(0.9) * v
            y = 0.03 + math.sin(0.9) * u + math.cos(0.9) * v
            assert any(math.dist((x, y), (disc.x, disc.y)) <= disc.radius + 1e-9 for disc in discs)


def test_figures_of_unknown_type_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="gear_prat"):
        figures("gear_prat")


def own(mass: float = 0.4, **changed: Any) -> dict[str, Any]:
    """Return a box of 90 x 60 x 40 mm, as the cell describes it."""
    spot = {"position": [0.0, 0.0, 0.02], "radius": 0.03}
    values = {"centre_of_mass": [0.0, 0.0, 0.0], "lower": [-0.045, -0.03, -0.02], "upper": [0.045, 0.03, 0.02]}
    top = {"turn": [1.0, 0.0, 0.0, 0.0], **values, "radius": 0.0541, "spots": [spot], **changed}
    return {"mass": mass, "tops": [top]}


def spot(x: float = 0.0, z: float = 0.02, radius: float = 0.03) -> dict[str, Any]:
    return {"position": [x, 0.0, z], "radius": radius}


def test_trial_part_figures_follow_its_model() -> None:
    catalogue = Catalogue({"my_box": own(spots=[spot(radius=0.002, z=0.05), spot(x=0.01)])})
    assert "my_box" in catalogue
    assert "my_box" in catalogue.types
    kind = catalogue.figures("my_box")
    assert (kind.grip, kind.top, kind.below, kind.height) == ((0.01, 0.0), 0.02, 0.02, 0.04)
    for x in (-0.045, 0.045):
        for y in (-0.03, 0.03):
            assert any(math.dist((x, y), (disc.x, disc.y)) <= disc.radius + 1e-9 for disc in kind.outline)
    assert Catalogue().types == sorted(PART_TYPES)
    wide = Catalogue({"my_wheel": own(lower=[-0.2, -0.2, 0.0], upper=[0.2, 0.2, 0.02], radius=0.2)})
    assert wide.figures("my_wheel").outline == (Disc(0.0, 0.0, 0.2),)
    assert wide.max_extent == pytest.approx(0.2)


@pytest.mark.parametrize(
    ("values", "reason"),
    [
        (own(spots=[]), "it has no flat top for the cup"),
        (own(spots=[spot(radius=0.004)]), "its flat top is too small: a disc of 4 mm radius (needs 6 mm)"),
        (own(25.0), "it is too heavy: 25 kg, the arm carries 10 kg"),
        (own(5.0, spots=[spot(0.07)]), "it would turn the wrist: its flat top is 70 mm beside its centre of mass"),
        (own(spots=[spot(z=0.2)]), "it is too tall: 220 mm below the cup, 200 mm can be carried"),
    ],
)
def test_unsuitable_trial_part_is_refused_with_reason(values: dict[str, Any], reason: str) -> None:
    catalogue = Catalogue({"my_part": values})
    assert "my_part" not in catalogue
    assert catalogue.why_not("my_part") == reason
    assert catalogue.why_not("u_joint_part") == "its model is unknown"
    with pytest.raises(UnknownNameError):
        catalogue.figures("my_part")


def test_first_order_of_type_sets_side_up() -> None:
    upright, lying = own(spots=[spot(z=0.1)]), own(spots=[])
    on_its_side = {**lying["tops"][0], "turn": list(Pose.from_rpy((0.0, 0.0, 0.0), (0.0, math.pi / 2, 0.0)).quaternion)}
    catalogue = Catalogue({"my_part": {"mass": 0.4, "tops": [upright["tops"][0], on_its_side]}})
    assert "my_part" in catalogue
    goal = Pose.from_rpy((0.1, 0.0, 0.0), (0.0, -math.pi / 2, 0.0))  # its x axis up
    catalogue.note_order("my_part", goal)
    assert "my_part" not in catalogue
    assert catalogue.why_not("my_part") == "it has no flat top for the cup"
    assert catalogue.turned("my_part", goal).rotate((0.0, 0.0, 1.0)) == pytest.approx((0.0, 0.0, 1.0), abs=1e-9)
    catalogue.note_order("my_part", Pose())
    assert "my_part" not in catalogue
    assert catalogue.turned("gear_part", goal) is goal


angles, lengths = st.floats(-3.1, 3.1), st.floats(-0.3, 0.3)
poses = st.builds(Pose.from_rpy, st.tuples(lengths, lengths, lengths), st.tuples(angles, angles, angles))


def is_same(one: Pose, other: Pose) -> bool:
    """Return whether two poses agree; opposite quaternions are the same rotation."""
    cos = abs(sum(a * b for a, b in zip(one.quaternion, other.quaternion, strict=True)))
    return math.dist(one.position, other.position) < 1e-9 and cos > 1.0 - 1e-9


@given(poses, st.floats(0.0, 0.1), st.floats(-0.1, 0.1))
def test_part_turned_over_twice_is_as_before(pose: Pose, top: float, below: float) -> None:
    kind = PartFigures((0.0, 0.0), top, (Disc(0.0, 0.0, 0.1),), below, side=0.1)
    assert is_same(pose @ kind.other_side @ kind.other_side, pose)


def test_part_figures_hold_for_either_side() -> None:
    """A part that can be turned over reaches as far up and down, and covers the same floor, by its other frame."""
    turnable = [name for name in Catalogue().types if figures(name).side]
    assert turnable == ["pulley_part"]
    for name in turnable:
        kind = figures(name)
        corners = [(x, y, z) for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-kind.below, kind.top)]
        turned = [kind.other_side.transform(corner) for corner in corners]
        heights = sorted(round(z, 9) for _, _, z in turned)
        assert heights == sorted(round(z, 9) for _, _, z in corners)
        for disc in kind.outline:
            x, y, _ = kind.other_side.transform((disc.x, disc.y, 0.0))
            assert any(
                math.dist((x, y), (each.x, each.y)) < 1e-9 and each.radius == disc.radius for each in kind.outline
            )
        assert kind.grip == pytest.approx(kind.other_side.transform((*kind.grip, 0.0))[:2])


def test_side_of_pulley_is_that_of_its_model() -> None:
    """The cup meets it by the widest radius of the part, with the middle of the side within the cup's face."""
    kind, shapes = figures("pulley_part"), part_type("pulley_part").solid
    lower, upper = bounds(shapes)
    assert kind.side == pytest.approx(upper[0], abs=0.001)
    assert kind.side == pytest.approx(-lower[1], abs=0.001)
    assert (-kind.below, kind.top) == pytest.approx((lower[2], upper[2]), abs=0.001)


def test_side_up_is_other_side_if_own_z_points_down() -> None:
    kinds = Catalogue()
    upright, below = Pose.from_rpy((0.1, 0.2, 0.7), (0.1, 0.0, 0.5)), Pose.from_rpy((0.1, 0.2, 0.7724), (3.0, 0.0, 0.5))
    assert kinds.side_up("pulley_part", upright) == (upright, False)
    pose, is_turned = kinds.side_up("pulley_part", below)
    assert is_turned
    assert pose.rotate((0.0, 0.0, 1.0))[2] > 0.98
    assert pose.position == pytest.approx((0.1, 0.2, 0.7), abs=0.011)
    assert kinds.side_up("gear_part", below) == (below, False), "it is not turned over"
    assert kinds.side_up("u_joint_part", below) == (below, False)


@given(poses)
def test_side_up_points_up_and_is_its_own(pose: Pose) -> None:
    kinds = Catalogue()
    found, is_turned = kinds.side_up("pulley_part", pose)
    assert found.rotate((0.0, 0.0, 1.0))[2] >= -1e-9
    other = figures("pulley_part").other_side
    assert is_same(found @ other if is_turned else found, pose)


def test_turned_pulley_lies_as_figures_say() -> None:
    """The part itself, dropped with its other side up, rests where its other frame is at the floor."""
    spec = mujoco.MjSpec.from_string('<mujoco><worldbody><geom type="plane" size="1 1 1"/></worldbody></mujoco>')
    visuals = Visuals()
    add_part_meshes(visuals)
    kind = figures("pulley_part")
    dropped = Pose.from_rpy((0.0, 0.0, 0.005), (0.0, 0.0, 0.3)) @ kind.other_side.inverse()
    add_part(spec, visuals, "part", part_type("pulley_part"), dropped)
    model = spec.compile()
    data = mujoco.MjData(model)
    while data.time < 1.0:
        mujoco.mj_step(model, data)
    x, y, z, *quaternion = data.qpos[:7].tolist()
    pose, is_turned = Catalogue().side_up("pulley_part", Pose((x, y, z), tuple(quaternion)))
    assert is_turned
    assert pose.position == pytest.approx((0.0, 0.0, 0.0), abs=0.003)
    assert pose.rpy == pytest.approx((0.0, 0.0, 0.3), abs=0.02)
