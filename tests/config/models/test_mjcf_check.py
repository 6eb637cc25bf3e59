from pathlib import Path

import pytest

from cellwright.config.models.files import MAX_GEOMS, ModelFileError, check_mjcf, open_model

BODY = '<worldbody><body><geom size=".1"/></body></worldbody>'


def check(folder: Path, inside: str) -> None:
    path = folder / "model.xml"
    path.write_text(f"<mujoco>{inside}</mujoco>", encoding="utf-8")
    check_mjcf(open_model(path))


@pytest.mark.parametrize(
    ("inside", "why"),
    [
        (
            '<worldbody><replicate count="1000000"><geom size=".1"/></replicate></worldbody>',
            "<replicate> is not supported",
        ),
        ("<keyframe/>", "<keyframe> is not supported"),
        ('<size memory="60G"/>' + BODY, "<size memory> is not supported"),
        ('<size nkey="100000000"/>' + BODY, "nkey of <size> must be at most 4096 (got '100000000')"),
        ('<size nuser_geom="1e300"/>' + BODY, "at most 4096"),
        ('<size nuserdata="nan"/>' + BODY, "at most 4096"),
        (
            '<asset><texture type="2d" builtin="flat" width="60000" height="2"/></asset>' + BODY,
            "width of <texture> must be at most 4096 (got '60000')",
        ),
        ('<asset><mesh name="m" builtin="supersphere" params="20000 1 1"/></asset>' + BODY, "<mesh builtin>"),
        ("<worldbody><body>" + '<geom size=".1"/>' * (MAX_GEOMS + 1) + "</body></worldbody>", "(got 201, at most 200)"),
    ],
)
def test_mjcf_of_excessive_cost_is_refused(tmp_path: Path, inside: str, why: str) -> None:
    with pytest.raises(ModelFileError, match=r"model\.xml: ") as refused:
        check(tmp_path, inside)
    assert why in str(refused.value)


@pytest.mark.parametrize(
    "inside",
    [
        BODY,
        '<size nuser_geom="3" njmax="500"/>' + BODY,
        '<asset><texture type="2d" name="1e9" builtin="checker" width="512" height="512" rgb1="1 1 1"/></asset>' + BODY,
        "<worldbody><body>" + '<geom size=".1"/>' * MAX_GEOMS + "</body></worldbody>",
    ],
)
def test_usual_mjcf_is_accepted(tmp_path: Path, inside: str) -> None:
    check(tmp_path, inside)
