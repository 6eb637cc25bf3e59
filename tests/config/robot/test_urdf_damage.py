"""Damaged robot files: each is a robot that can be built, or is refused with one-line errors."""

from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cellwright.config.robot.config import RobotConfig
from cellwright.config.robot.model import link_poses
from cellwright.config.robot.urdf import read_urdf
from cellwright.robot.model import build_robot
from cellwright.util.errors import DescriptionError

WHOLE = """<?xml version="1.0"?><robot name="r"><material name="red"><color rgba="1 0 0 1"/></material>
<link name="a"><inertial><origin xyz="0 0 1" rpy="1 2 3"/><mass value="2"/>
<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>
<visual><origin xyz="0 0 1"/><geometry><box size="1 2 3"/></geometry><material name="red"/></visual>
<collision><geometry><cylinder radius="1" length="2"/></geometry></collision></link>
<link name="b"><visual><geometry><mesh filename="package://x/y.stl" scale="1 1 1"/></geometry></visual></link>
<link name="c"/><link name="d"/>
<joint name="j" type="revolute"><origin xyz="1 2 3" rpy="0.1 0.2 0.3"/><parent link="a"/><child link="b"/>
<axis xyz="0 0 1"/><limit lower="-1" upper="1" effort="10" velocity="2"/></joint>
<joint name="k" type="prismatic"><parent link="b"/><child link="c"/><axis xyz="1 0 0"/>
<limit lower="0" upper="1" effort="10" velocity="2"/><mimic joint="j" multiplier="2" offset="1"/></joint>
<joint name="l" type="continuous"><parent link="a"/><child link="d"/></joint></robot>"""
NUMBERS = (
    "",
    " ",
    "nan",
    "inf",
    "-1",
    "0",
    "1e308",
    "1e-320",
    "1 2",
    "1 2 3 4",
    "1,2,3",
    "9" * 400,
    "0x1",
    "1_0",
    "\u0661",
)
NAMES = ("a", "b", "j", "world", "cellwright base", "fixed", "floating", "planar", "spherical", "mesh", "sphere")
MARKUP = ("<", "/>", '"', "&amp;", "&#0;", "&x;", "<!DOCTYPE a>", "<![CDATA[", "<!--", "-->", "<xacro:x/>", "${1/0}")
STRAYS = ("\0", "\x1a", "\ufeff", "ä", "\n", "$(find x)", "$(optenv HOME)")
SNIPPETS = (*NUMBERS, *NAMES, *MARKUP, *STRAYS)
QUOTED = [at for at, character in enumerate(WHOLE) if character == '"'][::2]


@st.composite
def damaged(draw: st.DrawFn) -> str:
    """Return the whole file with some attributes replaced, pieces inserted, and pieces cut out."""
    text = WHOLE
    for _ in range(draw(st.integers(1, 4))):
        snippet = draw(st.sampled_from(SNIPPETS))
        if draw(st.integers(0, 3)):
            start = draw(st.sampled_from(QUOTED)) + 1
            end = text.find('"', start)
        else:
            start = draw(st.integers(0, len(text)))
            end = start + draw(st.integers(0, 60))
        text = text[:start] + snippet + (text[end:] if end >= 0 else "")
    return text


@settings(max_examples=200, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(text=damaged(), self_collision=st.booleans())
def test_damaged_urdf_is_read_or_refused_in_lines(tmp_path: Path, text: str, self_collision: bool) -> None:
    path = tmp_path / "robot.urdf"
    path.write_text(text, "utf-8")
    lines: list[str] = []
    try:
        robot = read_urdf(path, warn=lines.append)
    except DescriptionError as error:
        lines += [str(problem) for problem in error.problems] or ["no problem is listed"]
    else:
        poses = link_poses(robot, {joint.name: 1.0 for joint in robot.driven})
        assert all(pose.is_finite() for pose in poses.values())
        build_robot(RobotConfig(robot, "robot", path, path), self_collision=self_collision)
    for line in lines:
        assert line.startswith(str(path))
        assert "\n" not in line
