"""Model files with any content: each is read, or refused as such."""

from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from cellwright.config.check import check
from cellwright.config.models.files import ModelFileError
from cellwright.config.models.meshes import MAX_COORDINATE, Triangles, read_mesh

WORDS = st.sampled_from(
    ["v", "f", "vertex", "solid", "facet", "1", "-1", "2", "3", "0.5", "1e999", "nan", "1/2/3", "x"]
)
LINES = st.lists(st.lists(WORDS, max_size=5).map(" ".join), max_size=12).map("\n".join)
TAGS = st.sampled_from(
    ["sdf", "robot", "mujoco", "model", "link", "joint", "collision", "visual", "geometry", "box", "mesh"]
)
TEXTS = st.sampled_from(["", "1 1 1", "0.1", "nan", "a.stl", "../a.stl", "model://x/y"])
ELEMENTS = st.recursive(
    st.builds("<{0}>{1}</{0}>".format, TAGS, TEXTS),
    lambda inner: st.builds(
        "<{0} name='a' type='fixed' file='{1}'>{2}</{0}>".format, TAGS, TEXTS, st.lists(inner).map("".join)
    ),
    max_leaves=8,
)


def read(path: Path) -> Triangles | str:
    """Return the mesh, or the reason why there is none."""
    try:
        return read_mesh(path)
    except ModelFileError as error:
        return str(error)


@given(st.binary(max_size=300) | LINES.map(str.encode))
@example(bytes(80) + (1).to_bytes(4, "little") + bytes(50))
@example(b"f 99999999999999999999999 1 2")
@example(b"v 1 2\nv 1 2\nv 1 2\nf 1 2 2")
@example(b"f 0 0 0")
def test_any_mesh_content_is_read_or_refused(content: bytes) -> None:
    with TemporaryDirectory() as folder:
        for name in ("a.stl", "a.obj"):
            path = Path(folder) / name
            path.write_bytes(content)
            found = read(path)
            if isinstance(found, str):
                assert found.startswith(f"{path}: ")
            else:
                vertices, triangles = found
                assert np.abs(vertices).max() <= MAX_COORDINATE
                assert 0 <= triangles.min() <= triangles.max() < len(vertices)


@pytest.mark.slow
@given(ELEMENTS | st.text(max_size=100))
@example("<a" * 3000)
@example("<sdf>" + "<model>" * 2000 + "</model>" * 2000 + "</sdf>")
def test_any_model_content_is_read_or_refused(content: str) -> None:
    with TemporaryDirectory() as folder:
        (Path(folder) / "a.xml").write_bytes(content.encode("utf-8", "surrogatepass"))
        trial = Path(folder) / "t.yaml"
        trial.write_text("cellwright: {parts: {my_part: {file: a.xml, mass: 1}}}")
        assert all(f"{trial}:1: cellwright.parts.my_part" in problem for problem in check([trial]).errors)


@given(st.text(min_size=1, max_size=20) | st.just("a" * 5000))
def test_any_model_path_is_refused_with_place(path: str) -> None:
    quoted = '"' + "".join(f"\\U{ord(letter):08x}" for letter in path) + '"'
    with TemporaryDirectory() as folder:
        trial = Path(folder) / "t.yaml"
        trial.write_text(f"cellwright: {{parts: {{my_part: {{file: {quoted}, mass: 1}}}}}}")
        (problem,) = check([trial]).errors
        assert problem.startswith(f"{trial}:1: cellwright.parts.my_part")


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("bits", [b"\x01\x00\xa0\x7f", b"\x00\x00\xc0\x7f", b"\x00\x00\x80\x7f"])
def test_number_of_a_mesh_that_is_not_finite_is_refused_without_a_warning(tmp_path: Path, bits: bytes) -> None:
    file = tmp_path / "a.stl"
    file.write_bytes(bytes(80) + (1).to_bytes(4, "little") + bits * 12 + bytes(2))
    with pytest.raises(ModelFileError, match="a coordinate is not a finite number"):
        read_mesh(file)
