"""Attributes, elements and texts that mean nothing: each kind is reported once."""

from pathlib import Path

import pytest

from tests.config.robot.test_urdf import LIMIT, joint, read, read_errors, robot

BOX = '<geometry><box size="1 1 1"/></geometry>'


def warnings_of(folder: Path, inside: str, link: str = "") -> list[str]:
    """Return the warnings about a joint, in line 4, and about a link, in line 6, without the file's name."""
    last = joint("k", "a", "c", LIMIT)
    text = robot(joint("j", "a", "b", inside), f'<link name="c">{link}</link>\n', last, links="ab")
    return [warning.removeprefix("robot.urdf:") for warning in read(folder, text)[1]]


@pytest.mark.parametrize(
    ("inside", "warning"),
    [
        (
            f'{LIMIT}<mimic joint="k" mulitplier="2"/>',
            "5: joint[j].mimic: unknown attribute 'mulitplier' of <mimic>, ignored; did you mean multiplier",
        ),
        (
            '<limit lower="-1" upper="1" effort="1" velocity="1" min="0"/>',
            "5: joint[j].limit: unknown attribute 'min' of <limit>, ignored (known: lower, upper, effort, velocity)",
        ),
        (
            f'{LIMIT}<origin x="1"/>',
            "5: joint[j].origin: unknown attribute 'x' of <origin>, ignored (known: xyz, rpy, quat_xyzw)",
        ),
        (
            '<limit effort="1" velocity="1"><lower>-1</lower></limit>',
            "5: joint[j].limit.lower: unknown element <lower>, ignored; write it as an attribute of <limit>",
        ),
        (
            f'{LIMIT}<axis xyz="1 0 0"/><axis xyz="0 0 1"/>',
            "5: joint[j].axis: more than one axis in <joint>; the first is used, this one is ignored",
        ),
        (f"{LIMIT}<orgin/>", "5: joint[j].orgin: unknown element <orgin>, ignored; did you mean origin"),
        (
            f'{LIMIT}<mass value="1"/>',
            "5: joint[j].mass: unknown element <mass>, ignored; it must be inside of <inertial>",
        ),
        (f"{LIMIT}<motor/>", "5: joint[j].motor: unknown element <motor>, ignored in <joint>"),
        (
            f'{LIMIT}<mimic joint="k">2</mimic>',
            "5: joint[j].mimic: the text '2' in <mimic> is ignored; write attributes (joint, multiplier, offset)",
        ),
        (f"{LIMIT}revolute", "4: joint[j]: the text 'revolute' in <joint> is ignored"),
    ],
)  # fmt: skip
def test_ignored_word_in_joint_is_reported(tmp_path: Path, inside: str, warning: str) -> None:
    assert warning in warnings_of(tmp_path, inside)


@pytest.mark.parametrize(
    ("link", "warning"),
    [
        (f"<visual>{BOX}{BOX}</visual>", "more than one geometry in <visual>; the first is used, this one is ignored"),
        (
            '<visual><geometry><box size="1 1 1"/><sphere radius="1"/></geometry></visual>',
            "more than one shape in <geometry>; the first is used, this one is ignored",
        ),
        ("<visual><geometry><box sise='1 1 1' size='1 1 1'/></geometry></visual>",
         "unknown attribute 'sise' of <box>, ignored; did you mean size"),
        ('<mass value="1"/>', "unknown element <mass>, ignored; it must be inside of <inertial>"),
        (f'<colision>{BOX}</colision>', "unknown element <colision>, ignored; did you mean collision"),
        ('<joint name="x"/>', "unknown element <joint>, ignored; it must be inside of <robot>"),
    ],
)  # fmt: skip
def test_ignored_word_in_link_is_reported(tmp_path: Path, link: str, warning: str) -> None:
    found = warnings_of(tmp_path, LIMIT, link)
    assert any(line.startswith("6: link[c]") and line.endswith(warning) for line in found), found


def test_words_of_other_programs_are_ignored_silently(tmp_path: Path) -> None:
    others = "<dynamics damping='1'/><safety_controller k_velocity='1'/><calibration/><gazebo/><drake:x/>"
    link = f"<gazebo><x/></gazebo><visual name='v' drake:y='1'>{BOX}<material name='m'><texture/></material></visual>"
    assert warnings_of(tmp_path, LIMIT + others, link) == []


def test_equal_findings_are_one_line_with_their_count(tmp_path: Path) -> None:
    text = robot(*(joint(name, "a", name, f'{LIMIT}<origin x="1"/>') for name in "bc"), links="abc")
    (warning,) = read(tmp_path, text)[1]
    assert warning.startswith("robot.urdf:6: joint[b].origin: unknown attribute 'x'")
    assert warning.endswith("(2 times)")


@pytest.mark.parametrize("version", ["1.0", "1", "1.1", "1.2"])
def test_known_versions_are_read(tmp_path: Path, version: str) -> None:
    assert read(tmp_path, f'<robot name="r" version="{version}"><link name="a"/></robot>')[1] == []


@pytest.mark.parametrize("version", ["2.0", "1.3", "one"])
def test_unknown_version_is_refused(tmp_path: Path, version: str) -> None:
    text = f'<robot name="r" version="{version}"><link name="a"/></robot>'
    assert read_errors(tmp_path, text) == [
        f"robot.urdf:1: unknown version '{version}' of URDF (known: 1.0, 1, 1.1, 1.2)"
    ]
