"""Bounds of one trial: beyond them there is one error line, quickly, and nothing is built."""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import pytest

from cellwright.cell.cell import Cell
from cellwright.cell.model import build
from cellwright.config.models import files
from cellwright.config.parsing import reader, tree
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.errors import DescriptionError, SimulationError

PART = "{type: gear_part, pose: {}}"
ORDER = f"{{announcement_condition: time, announcement_condition_value: 1, kit_count: 100, parts: {{a: {PART}}}}}"
SPHERE = "{sphere: {radius: 0.1}}"


def repeated(count: int, entry: str) -> str:
    return ", ".join(f"a{number}a: {entry}" for number in range(count))


def read_errors(text: str) -> list[str]:
    with pytest.raises(DescriptionError) as raised:
        load_trial(text=text)
    return list(map(str, raised.value.problems))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            f"sensors: {{{repeated(501, '{type: break_beam, pose: {}}')}}}",
            "sensors: too many sensors (got 501, at most 500)",
        ),
        (f"orders: {{{repeated(51, ORDER)}}}", "orders: asks for more than 10000 kits and parts in total"),
        (
            f"cellwright: {{parts: {{{repeated(201, '{}')}}}}}",
            "cellwright.parts: too many part types (got 201, at most 200)",
        ),
    ],
)
def test_excessive_counts_are_refused(text: str, message: str) -> None:
    assert read_errors(text) == [f"<text>:1: {message}"]


def test_problems_beyond_maximum_are_counted() -> None:
    errors = read_errors("\n".join(f"section_{number}: 1" for number in range(1500)))
    assert len(errors) == tree.MAX_PROBLEMS + 1
    assert errors[-1] == "<text>:1001: 500 more errors are not listed"
    warned = load_trial(text=f"options: {{{repeated(1500, '1')}}}").warnings
    assert len(warned) == tree.MAX_PROBLEMS + 1
    assert warned[-1].severity == "warning"


def test_mesh_size_of_trial_is_limited_in_total(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    corner = "v 0 0 0\nv .1 0 0\nv 0 .1 0\nv 0 0 .1\nf 1 2 3\n"
    for name in "ab":
        (tmp_path / f"{name}.obj").write_text(corner)
    text = (
        "cellwright: {{parts: {{my_part: {{mass: 1, shapes: [{{mesh: a.obj}}, {{mesh: a.obj}}, {{mesh: {}.obj}}]}}}}}}"
    )
    path = tmp_path / "trial.yaml"
    monkeypatch.setattr(reader, "MAX_MESH_BYTES", len(corner))
    path.write_text(text.format("a"))
    assert load_trial([path]).trial.part_models  # the same file counts once
    path.write_text(text.format("b"))
    with pytest.raises(DescriptionError, match="the meshes of the trial exceed"):
        load_trial([path])


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("<robot>" + "<link>" * 60 + "</link>" * 60 + "</robot>", "elements nested deeper than 50"),
        ("<robot>" + "<a/>" * 20_001 + "</robot>", "more than 20000 elements"),
        (
            "<robot>" + "".join(f'<link name="{k}"/>' for k in range(301)) + "</robot>",
            "too many links (got 301, at most 300)",
        ),
        ("<robot><link>" + "<visual/>" * 201 + "</link></robot>", "too many shapes (got 201, at most 200)"),
        ("<sdf>" + " " * (1 << 20) + "</sdf>", "larger than 1 MiB"),
    ],
)
def test_excessive_models_are_refused(tmp_path: Path, content: str, message: str) -> None:
    (tmp_path / "model.xml").write_text(content)
    path = tmp_path / "trial.yaml"
    path.write_text("cellwright: {furniture: [{name: a, file: model.xml}]}")
    with pytest.raises(DescriptionError, match=re.escape(message)):
        load_trial([path])


@pytest.mark.parametrize("entry", ["file: /dev/zero", "shapes: [{mesh: endless.stl}]", "file: endless.stl"])
def test_endless_files_are_refused(tmp_path: Path, entry: str) -> None:
    (tmp_path / "endless.stl").symlink_to("/dev/zero")
    path = tmp_path / "trial.yaml"
    path.write_text(f"cellwright: {{furniture: [{{name: a, {entry}}}]}}")
    with pytest.raises(DescriptionError, match="not a regular file"):
        load_trial([path])


def test_oversized_picture_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.png").write_bytes(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR" + (99_999).to_bytes(4, "big") * 2)
    (tmp_path / "model.xml").write_text(
        '<mujoco><asset><texture file="a.png"/></asset><worldbody><geom size="1"/></worldbody></mujoco>'
    )
    path = tmp_path / "trial.yaml"
    path.write_text("cellwright: {furniture: [{name: a, file: model.xml}]}")
    with pytest.raises(DescriptionError, match=r"at most 4096 pixels \(got 99999 x 99999\)"):
        load_trial([path])


GRID = "{xyz_start: [0, 0, 0], xyz_end: [0.1, 0, 0], rpy: [0, 0, 0], num_models_x: %d, num_models_y: 1}"


def parts(count: int) -> str:
    return f"""options: {{insert_models_over_bins: true, insert_agvs: false}}
models_over_bins: {{bin7: {{models: {{my_part: {GRID % count}}}}}}}
cellwright: {{parts: {{my_part: {{mass: 1, shapes: [{", ".join([SPHERE] * 50)}]}}}}}}"""


def test_shapes_of_all_parts_are_limited_in_total(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "MAX_SHAPES", 99)
    with pytest.raises(DescriptionError, match=r"the parts may have at most 99 shapes in total \(got 100\)"):
        Cell(load_trial(text=parts(2)).trial)


def test_engine_out_of_memory_gives_one_line_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(build, "_MANY_PARTS", 0)
    monkeypatch.setattr(build, "_MAX_MEMORY", 20_000)
    with pytest.raises(SimulationError, match="the engine gave up: mj_stackAlloc: out of memory") as raised:
        Cell(load_trial(text=parts(2)).trial)
    assert "\n" not in str(raised.value)


def test_engine_failure_in_step_names_time(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail_step(*_: object) -> None:
        raise mujoco.FatalError("no room\nfor anything")

    cell = Cell(load_trial(text="options: {insert_agvs: false}").trial)
    cell.step()
    monkeypatch.setattr(mujoco, "mj_step", fail_step)
    with pytest.raises(SimulationError, match=r"at 0\.002 s: the engine gave up: no room$"):
        cell.step()


def test_mesh_limit_of_trial_covers_single_file() -> None:
    assert reader.MAX_MESH_BYTES >= files.MAX_ASSET_BYTES
