"""Links: mass, inertia, shapes and colours."""

from pathlib import Path

import pytest

from cellwright.config.models.model import ModelShape
from cellwright.config.robot.model import Inertial, Link
from cellwright.util.pose import Pose
from tests.config.robot.test_urdf import read, read_errors, robot


def read_link(folder: Path, inside: str, before: str = "") -> tuple[Link, list[str]]:
    found, warnings = read(folder, robot(before, f'<link name="a">\n{inside}</link>'))
    return found.links["a"], [warning.removeprefix("robot.urdf:") for warning in warnings]


def inertial(mass: str, inertia: str) -> str:
    return f'<inertial><origin xyz="0 0 0.1"/><mass value="{mass}"/><inertia {inertia}/></inertial>'


def test_mass_and_inertia_are_read(tmp_path: Path) -> None:
    link, warnings = read_link(tmp_path, inertial("2", 'ixx="1" iyy="2" izz="2.5" ixy="0.1" ixz="0.2" iyz="0.3"'))
    assert link.inertial == Inertial(2.0, Pose((0.0, 0.0, 0.1)), (1.0, 2.0, 2.5, 0.1, 0.2, 0.3))
    assert read_link(tmp_path, "")[0].inertial is None
    assert warnings == []


@pytest.mark.parametrize("figures", ["", 'ixx="0" iyy="0" izz="0"', 'ixx="-1" iyy="1" izz="1"', 'ixx="1"'])
def test_impossible_inertia_becomes_that_of_water_sphere(tmp_path: Path, figures: str) -> None:
    link, warnings = read_link(tmp_path, inertial("1", figures))
    assert link.inertial is not None
    assert link.inertial.inertia == pytest.approx((1.539e-3,) * 3 + (0.0,) * 3, rel=1e-3)
    assert warnings == ["1: a link has no valid inertia (a); that of a water sphere of the same mass is used"]


def test_link_of_mass_0_has_no_inertia(tmp_path: Path) -> None:
    link, warnings = read_link(tmp_path, inertial("0", 'ixx="1" iyy="-1" izz="1"'))
    assert (link.inertial, warnings) == (Inertial(0.0, Pose((0.0, 0.0, 0.1))), [])


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        (inertial("-1", ""), "3: link[a].inertial.mass: mass must be from 0 to 1e+06 kg (got -1)"),
        (inertial("heavy", ""), "3: link[a].inertial.mass: value must be a finite number (got 'heavy')"),
        ("<inertial/>", '3: link[a].inertial: <inertial> requires <mass value="…"/> [kg]'),
        (inertial("1", 'ixx="1 2"'), "3: link[a].inertial.inertia: ixx must be a finite number (got '1 2')"),
    ],
)
def test_invalid_inertial_is_refused(tmp_path: Path, inside: str, message: str) -> None:
    assert read_errors(tmp_path, robot(f'<link name="a">\n{inside}</link>')) == [f"robot.urdf:{message}"]


def visual(form: str, rest: str = "") -> str:
    return f"<visual>{rest}<geometry>{form}</geometry></visual>"


@pytest.mark.parametrize(
    ("form", "shape"),
    [
        ('<box size="1 2 3"/>', ModelShape("box", (1.0, 2.0, 3.0), is_touched=False)),
        ('<sphere radius="0.5"/>', ModelShape("sphere", (0.5, 0.0, 0.0), is_touched=False)),
        ('<cylinder radius="0.5" length="2"/>', ModelShape("cylinder", (0.5, 2.0, 0.0), is_touched=False)),
        ('<capsule radius="0.5" length="2"/>', ModelShape("capsule", (0.5, 2.0, 0.0), is_touched=False)),
    ],
)
def test_shape_elements_are_read(tmp_path: Path, form: str, shape: ModelShape) -> None:
    assert read_link(tmp_path, visual(form))[0].shapes == (shape,)


def test_collision_and_visual_shapes_are_distinct(tmp_path: Path) -> None:
    box = '<geometry><box size="1 1 1"/></geometry>'
    text = f'<collision><origin xyz="0 0 1" rpy="0 0 0"/>{box}</collision><visual>{box}</visual><visual>{box}</visual>'
    shapes = read_link(tmp_path, text)[0].shapes
    assert [(shape.is_touched, shape.is_seen) for shape in shapes] == [(True, False), (False, True), (False, True)]
    assert shapes[0].pose == Pose((0.0, 0.0, 1.0))


@pytest.mark.parametrize(
    ("form", "message"),
    [
        ("<torus/>", "geometry: unknown shape <torus>, ignored (known: box, cylinder, capsule, sphere, mesh)"),
        ("<boxx/>", "geometry: unknown shape <boxx>, ignored; did you mean box"),
        ("", "geometry: <visual> has no shape, ignored (known: box, cylinder, capsule, sphere, mesh)"),
        (
            '<box size="0 1 1"/>',
            "geometry.box: lengths must be above 0 and at most 10000 m (got 0 1 1); the box is ignored",
        ),
        (
            '<sphere radius="-1"/>',
            "geometry.sphere: lengths must be above 0 and at most 10000 m (got -1); the sphere is ignored",
        ),
        (
            '<sphere radius="1e9"/>',
            "geometry.sphere: lengths must be above 0 and at most 10000 m (got 1e+09); the sphere is ignored",
        ),
    ],
)
def test_invalid_shapes_are_ignored_with_warning(tmp_path: Path, form: str, message: str) -> None:
    link, warnings = read_link(
        tmp_path, visual(form) + '<collision><geometry><sphere radius="1"/></geometry></collision>'
    )
    assert len([shape for shape in link.shapes if not shape.is_touched]) == 0
    assert warnings == [f"3: link[a].visual.{message}"]


@pytest.mark.parametrize(
    ("form", "message"),
    [
        ("<box/>", "box: <box> requires size [m]"),
        ('<cylinder radius="1"/>', "cylinder: <cylinder> requires length [m]"),
        ('<box size="1 x 3"/>', "box: size must be 3 finite numbers with blanks between them (got '1 x 3')"),
        ("<mesh/>", 'mesh: <mesh> requires filename="…"'),
        ('<mesh filename="a.stl" scale="0 1 1"/>', "mesh: scale must be above 1e-09 and below 1e+09 in magnitude"),
    ],
)
def test_shapes_without_valid_attributes_are_refused(tmp_path: Path, form: str, message: str) -> None:
    problems = read_errors(tmp_path, robot(f'<link name="a">\n{visual(form)}</link>'))
    assert f"robot.urdf:3: link[a].visual.geometry.{message}" in problems


RED = '<material name="red"><color rgba="1 0 0 1"/></material>'
BOX = '<box size="1 1 1"/>'


@pytest.mark.parametrize(
    ("before", "material", "colour"),
    [
        ("", '<material name="x"><color rgba="0 0.5 2 1"/></material>', (0.0, 0.5, 1.0, 1.0)),
        (RED, '<material name="red"/>', (1.0, 0.0, 0.0, 1.0)),
        (f'<link name="b"><visual>{RED}</visual></link>', '<material name="red"/>', (1.0, 0.0, 0.0, 1.0)),
        ("", '<material name="red"/>', None),
        ("", "", None),
    ],
)
def test_colours_are_read_inline_or_by_name(
    tmp_path: Path, before: str, material: str, colour: tuple[float, float, float, float] | None
) -> None:
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>' if "link" in before else ""
    link, _ = read_link(tmp_path, visual(BOX, material), before + joint)
    assert link.shapes[0].colour == colour
