from pathlib import Path

import pytest

from cellwright.cell.model.own_models import read_mjcf
from cellwright.config.models.files import ModelFileError


def model(folder: Path, content: str) -> Path:
    path = folder / "model.xml"
    path.write_text(f"<mujoco><worldbody>{content}</worldbody></mujoco>", encoding="utf-8")
    return path


def test_mjcf_shapes_are_in_frame_of_single_outermost_body(tmp_path: Path) -> None:
    found = read_mjcf(model(tmp_path, '<body pos="1 2 3"><geom pos="0 0 .5" size=".1" mass="2"/></body>'))
    ((shape, mesh),) = found.shapes
    assert (shape.kind, shape.size, mesh) == ("sphere", (0.1, 0.0, 0.0), None)
    assert shape.pose.position == pytest.approx((0.0, 0.0, 0.5))
    assert found.mass == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ('<body><geom size="1e300"/></body>', "must be finite"),
        ('<body pos="nan 0 0"><geom size=".1"/></body>', "must be finite"),
        ('<body><joint/><geom size=".1"/></body>', "one rigid body"),
        ("<body/>", "no shapes"),
        ('<geom type="plane" size="1 1 1"/>', "geom type plane is not supported"),
        ('<body><geom size="-1"/></body>', "size"),
    ],
)
def test_unusable_mjcf_is_refused(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(ModelFileError, match=message):
        read_mjcf(model(tmp_path, content))
