import os
import subprocess
import sys
from pathlib import Path

import mujoco
import pytest

from cellwright.config.parsing.sources import sources_collected
from cellwright.config.robot.mjcf_file import MAX_FILES, compile_mjcf
from cellwright.config.robot.urdf import MAX_LINKS
from cellwright.util.errors import DescriptionError
from tests.config.robot.mjcf_robots import menagerie, quiet, write

ARM = '<worldbody><body name="a"><geom size="0.1"/></body></worldbody>'


def refused(path: Path) -> str:
    with pytest.raises(DescriptionError) as error:
        compile_mjcf(path)
    return str(error.value)


def test_included_files_are_read_and_their_elements_have_places(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    part = '<mujoco>\n\n<body name="hand"><freejoint/><geom size="0.1"/></body></mujoco>'
    (tmp_path / "parts" / "hand.xml").write_text(part, encoding="utf-8")
    path = write(tmp_path, '<worldbody><body name="a"/><frame><include file="parts/hand.xml"/></frame></worldbody>')
    compiled = compile_mjcf(path)
    assert [str(compiled.element("body", number).key) for number in (1, 2)] == ["body[a]", "body[hand]"]
    place = compiled.element("joint", 0).place
    assert (place.path, place.line) == (str(tmp_path / "parts" / "hand.xml"), 3)


def test_order_of_elements_is_that_of_the_model(tmp_path: Path) -> None:
    inner = '<body name="c"><geom name="g3" size="1"/></body>'
    inside = (
        f'<body name="a"><frame><frame>{inner}</frame><geom name="g2" size="1"/></frame>'
        '<geom name="g1" size="1"/></body>'
        '<geom name="g0" size="1"/><body name="b"><geom name="g4" size="1"/></body>'
    )
    compiled = compile_mjcf(write(tmp_path, f"<worldbody>{inside}</worldbody>"))
    for kind, count in (("body", compiled.model.nbody), ("geom", compiled.model.ngeom)):
        for number in range(kind == "body", count):
            assert compiled.element(kind, number).get("name") == getattr(compiled.model, kind)(number).name


@pytest.mark.parametrize(
    ("inside", "why"),
    [
        (
            "<worldbody><body><geom siz='1'/></body></worldbody>",
            "arm.xml:2: geom: the engine refuses it: Schema violation",
        ),
        (
            "\n<worldbody><body name='arm'><joint/></body></worldbody>",
            "arm.xml:3: body[arm]: the engine refuses it: mass and inertia of moving bodies must be larger than",
        ),
        (
            f"{ARM}\n<actuator><motor name='m' joint='none'/></actuator>",
            "arm.xml:3: motor[m]: the engine refuses it: unknown transmission target",
        ),
        (f'{ARM}\n<asset><mesh file="no.stl"/></asset>', "no.stl: there is no such file"),
        (f'{ARM}\n<asset><mesh file="arm.xml" name="m"/></asset>', "must be one of .stl, .obj; convert the mesh"),
        (f'{ARM}\n<asset><mesh file="/dev/zero" name="m"/></asset>', "there is no such file"),
        (
            f'{ARM}\n<asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>',
            "a <mesh> must be in a file (got vertices in the MJCF file)",
        ),
        (f'<include file="arm.xml"/>{ARM}', "arm.xml:2: include[arm.xml]: the file is included already"),
        (f'<include file="no.xml"/>{ARM}', "arm.xml:2: include[no.xml]: there is no file 'no.xml' in"),
        (f'<include file="{"x" * 5000}"/>{ARM}', "there is no file"),
        (
            '<worldbody><replicate count="1000000"><geom size=".1"/></replicate></worldbody>',
            "<replicate> is not supported",
        ),
        (f'<size memory="60G"/>{ARM}', "arm.xml:2: size: <size memory> is not supported"),
        (
            f'{ARM}<asset><texture name="t" type="2d" builtin="flat" width="60000" height="2"/></asset>',
            "arm.xml:2: texture[t]: width of <texture> must be at most 4096 (got '60000')",
        ),
        (
            "<worldbody>" + "<body/>" * (MAX_LINKS + 1) + "</worldbody>",
            f"too many bodies (got 1001, at most {MAX_LINKS})",
        ),
        ("<worldbody>" + "<body>" * 60 + "</body>" * 60 + "</worldbody>", "nested deeper than 50"),
        (
            '<worldbody><body name="a" pos="0 0 1e308"/></worldbody>',
            "arm.xml:2: body[a]: coordinates must be within ±1e+06 [m; rad] (got 0 0 1e+308)",
        ),
        ("<worldbody>", "invalid XML"),
        ("<!-- a -- b -->" + ARM, "XML forbids -- inside of a comment"),
    ],
)
def test_file_that_cannot_be_used_is_refused_with_its_place(tmp_path: Path, inside: str, why: str) -> None:
    assert why in refused(write(tmp_path, inside))


def test_other_files_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    path.write_text('<robot name="r"/>', encoding="utf-8")
    assert refused(path) == f"{path}:1: the root element of an MJCF file must be <mujoco> (got <robot>, a URDF file)"
    assert "there is no such file" in refused(tmp_path / "none.xml")
    path.write_text('<!DOCTYPE a [<!ENTITY b "c">]><mujoco/>', encoding="utf-8")
    assert "document types and entities are not supported" in refused(path)


def test_included_files_have_a_limit(tmp_path: Path) -> None:
    for number in range(MAX_FILES + 1):
        (tmp_path / f"{number}.xml").write_text("<mujoco/>", encoding="utf-8")
    includes = "".join(f'<include file="{number}.xml"/>' for number in range(MAX_FILES + 1))
    assert f"more than {MAX_FILES} included files" in refused(write(tmp_path, includes + ARM))


def test_linkage_of_a_gripper_is_refused_at_its_line() -> None:
    path = menagerie("robotiq_2f85/2f85.xml")
    with pytest.raises(DescriptionError) as error:
        quiet(path)
    message = "connect: a robot is a tree of joints, without an equality of type connect"
    assert [str(problem).partition(";")[0] for problem in error.value.problems] == [
        f"{path}:{line}: {message}" for line in (173, 174)
    ]


def test_warnings_of_the_engine_stay_inside(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    handler = mujoco.get_mju_user_warning()
    joints = '<joint name="a"/><joint name="b"/>'  # along one axis: the engine calls the inertia singular
    compile_mjcf(write(tmp_path, f'<worldbody><body>{joints}<geom size="0.1"/></body></worldbody>'))
    assert capfd.readouterr() == ("", "")
    assert mujoco.get_mju_user_warning() is handler
    assert sorted(path.name for path in tmp_path.iterdir()) == ["arm.xml", "mesh.obj"]


def test_configuration_does_not_load_the_engine() -> None:
    code = "import sys, cellwright.config.robot.mjcf, cellwright.config.robot.robots; sys.exit('mujoco' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], env={**os.environ}, check=False).returncode == 0


def test_files_that_are_read_belong_to_a_recording(tmp_path: Path) -> None:
    (tmp_path / "hand.xml").write_text("<mujoco><option/></mujoco>", encoding="utf-8")
    path = write(tmp_path, f'<include file="hand.xml"/>{ARM}<asset><mesh file="mesh.obj"/></asset>')
    with sources_collected() as sources:
        compile_mjcf(path)
    assert sorted(Path(name).name for name in sources.files()) == ["arm.xml", "hand.xml", "mesh.obj"]
