"""Bytes of robot files: tolerated ones, with a warning that names the place, and refused ones."""

import os
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cellwright.config.parsing.tree import Problems
from cellwright.config.robot.urdf_file import MAX_BYTES, MAX_DEPTH, Element, read_elements
from cellwright.util.errors import DescriptionError


def read(folder: Path, content: bytes) -> tuple[Element, list[str]]:
    """Return the root element, and the warnings without the path's folder."""
    path = folder / "robot.urdf"
    path.write_bytes(content)
    problems = Problems()
    element = read_elements(path, problems)
    return element, [str(warning).replace(f"{folder}/", "") for warning in problems.warnings]


def read_errors(folder: Path, content: bytes) -> str:
    with pytest.raises(DescriptionError) as raised:
        read(folder, content)
    return str(raised.value).replace(f"{folder}/", "")


def test_elements_have_key_and_line(tmp_path: Path) -> None:
    element, warnings = read(tmp_path, b'<robot>\n<link name="a">\n <visual>\n  <geometry/></visual></link></robot>')
    geometry = element.children[0].children[0].children[0]
    assert (geometry.key, geometry.place.line) == ("link[a].visual.geometry", 4)
    assert element.find("joint") is None
    assert [child.get("name") for child in element.all("link", "joint")] == ["a"]
    assert warnings == []


def test_control_bytes_give_one_warning(tmp_path: Path) -> None:
    element, warnings = read(tmp_path, b'<robot>\n\n<link \x1aname="a"/></robot>\0\n')
    assert element.children[0].get("name") == "a"
    assert warnings == ["robot.urdf:3: control byte 0x1A (character 15 of the file, and 1 more); treated as a blank"]


def test_comment_with_dashes_is_ignored_with_warning(tmp_path: Path) -> None:
    text = b"<robot>\n<!-- -- the\n arm ---><link name='a'/>\n<!----- b --><link name='b'/><!-- c --></robot>"
    element, warnings = read(tmp_path, text)
    assert [(child.get("name"), child.place.line) for child in element.children] == [("a", 3), ("b", 4)]
    assert warnings == ["robot.urdf:2: XML forbids -- inside of a comment (and 1 more); the comment is ignored"]


def test_git_lfs_pointer_is_named(tmp_path: Path) -> None:
    pointer = b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n"
    assert read_errors(tmp_path, pointer) == (
        "robot.urdf: a Git LFS pointer, not the file itself; fetch the file with: git lfs pull"
    )


@pytest.mark.parametrize(
    "content",
    [
        b'\xef\xbb\xbf<?xml version="1.0" encoding="utf-8"?><robot name="\xc3\xa4"/>',
        b'\n\n  <!-- first --> <?xml version="1.0"?><robot name="\xc3\xa4"/>',
        '<?xml version="1.0" encoding="UTF-16"?><robot name="ä"/>'.encode("utf-16"),
        b'<?xml version="1.0" encoding="ISO-8859-1"?><robot name="\xe4"/>',
    ],
)
def test_encodings_and_text_before_declaration_are_tolerated(tmp_path: Path, content: bytes) -> None:
    element, warnings = read(tmp_path, content)
    assert element.get("name") == "ä"
    assert warnings == []


def test_invalid_utf_8_is_read_as_latin_1_with_warning(tmp_path: Path) -> None:
    element, warnings = read(tmp_path, b'<robot name="\xe4"/>')
    assert element.get("name") == "ä"
    assert warnings == ["robot.urdf: not UTF-8 text; read as Latin-1"]


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "robot.urdf: the file is empty"),
        (b" \n\0", "robot.urdf: the file is empty"),
        (b"<robot>\n<link>", "robot.urdf:2: invalid XML: no element found (column 7)"),
        (b"<robot>\n</link>", "robot.urdf:2: invalid XML: mismatched tag (column 3)"),
        (b"\n<!DOCTYPE robot><robot/>", "robot.urdf:2: document types and entities are not supported; remove them"),
        (b"<robot/>\n<robot/>", "robot.urdf:2: invalid XML: junk after document element (column 1)"),
        (b"<robot>&lol;</robot>", "robot.urdf:1: invalid XML: undefined entity (column 8)"),
    ],
)
def test_invalid_xml_is_refused_with_line(tmp_path: Path, content: bytes, message: str) -> None:
    assert read_errors(tmp_path, content) == message


def test_entity_bomb_is_refused_unexpanded(tmp_path: Path) -> None:
    levels = "".join(f'<!ENTITY a{n + 1} "{f"&a{n};" * 10}">' for n in range(9))
    content = f'<!DOCTYPE r [<!ENTITY a0 "x">{levels}]><robot name="&a9;"/>'
    assert "document types and entities are not supported" in read_errors(tmp_path, content.encode())


@pytest.mark.slow
def test_missing_or_excessive_files_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DescriptionError, match="there is no such file"):
        read_elements(tmp_path / "nothing.urdf", Problems())
    with pytest.raises(DescriptionError, match="is a folder; name the URDF file in it"):
        read_elements(tmp_path, Problems())
    assert (
        read_errors(tmp_path, b"<robot>" + b" " * MAX_BYTES) == "robot.urdf: larger than 16 MiB; is this a robot file?"
    )
    assert "nested deeper than" in read_errors(tmp_path, b"<a>" * (MAX_DEPTH + 1) + b"</a>" * (MAX_DEPTH + 1))
    assert "more than 200000 elements" in read_errors(tmp_path, b"<a>" + b"<b/>" * 200_000 + b"</a>")


def test_optenv_is_replaced_by_environment_or_default(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = b'<robot><origin xyz="$(optenv ROBOT_MOUNT 0.1 0.2 0.3)" rpy="$(optenv ROBOT_TILT)"/></robot>'
    monkeypatch.delenv("ROBOT_MOUNT", raising=False)
    monkeypatch.setenv("ROBOT_TILT", '1 2 3 "<&')
    origin = read(tmp_path, text)[0].children[0]
    assert origin.get("xyz") == "0.1 0.2 0.3"
    assert origin.get("rpy") == '1 2 3 "<&'


@settings(max_examples=150, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(content=st.binary(max_size=200) | st.text("<>/=\"' ar\n&;!-?[]", max_size=60).map(str.encode))
def test_any_bytes_are_read_or_refused_with_place(tmp_path: Path, content: bytes) -> None:
    message = ""
    try:
        read(tmp_path, content)
    except DescriptionError as error:
        message = str(error)
    assert message == "" or message.startswith(f"{tmp_path}{os.sep}robot.urdf")
    assert "\n" not in message
