"""Models in SDF, URDF and MJCF, changed as trees, through the loader, the engine's compiler, and fifty steps."""

from __future__ import annotations

import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

from cellwright.cell.cell import Cell
from cellwright.config.models.files import ModelFileError
from cellwright.config.trial.gear2017 import load_trial
from cellwright.util.errors import DescriptionError, SimulationError
from fuzz import seeds as bundled
from fuzz import xml_trees
from fuzz.targets.cell import run
from fuzz.verdict import check_lines, check_refusal

MAX_SIZE = 6000
TAGS = (
    *(
        "sdf",
        "robot",
        "mujoco",
        "world",
        "model",
        "link",
        "joint",
        "pose",
        "collision",
        "visual",
        "geometry",
        "box",
        "size",
    ),
    *(
        "sphere",
        "cylinder",
        "capsule",
        "mesh",
        "uri",
        "scale",
        "radius",
        "length",
        "inertial",
        "mass",
        "material",
        "diffuse",
    ),
    *(
        "worldbody",
        "body",
        "geom",
        "freejoint",
        "asset",
        "texture",
        "option",
        "compiler",
        "default",
        "size",
        "site",
        "light",
    ),
    *(
        "replicate",
        "frame",
        "include",
        "custom",
        "numeric",
        "tuple",
        "contact",
        "exclude",
        "equality",
        "keyframe",
        "sensor",
    ),
)
NAMES = (
    *(
        "name",
        "type",
        "size",
        "pos",
        "quat",
        "euler",
        "mass",
        "density",
        "file",
        "mesh",
        "vertex",
        "face",
        "scale",
        "rgba",
    ),
    *(
        "fromto",
        "builtin",
        "width",
        "height",
        "count",
        "nuser_body",
        "memory",
        "njmax",
        "timestep",
        "class",
        "group",
        "data",
    ),
    *("value", "xyz", "rpy", "link", "filename", "radius", "length", "contype", "conaffinity", "inertia", "fitscale"),
)
WORDS = (*TAGS, *NAMES)
_FOLDER = Path(tempfile.mkdtemp(prefix="cellwright-fuzz-"))
_MODEL = _FOLDER / "model.xml"
_TRIAL = _FOLDER / "trial.yaml"
_TRIAL.write_text(
    "options: {insert_agvs: false, insert_models_over_bins: true}\n"
    "cellwright: {parts: {block_part: {file: model.xml, mass: 0.2}}, furniture: [{name: piece, file: model.xml}]}\n"
    "models_over_bins: {bin7: {models: {block_part: {xyz_start: [0.1, 0.1, 0.1], xyz_end: [0.4, 0.4, 0], "
    "rpy: [0, 0, 0], num_models_x: 1, num_models_y: 1}}}}\n"
)


def seeds() -> Iterator[bytes]:
    """Yield a model in every format."""
    yield from bundled.files("docs/examples/own_models/flange.urdf", "docs/examples/own_models/valve/model.sdf")
    yield b'<mujoco><worldbody><body><freejoint/><geom type="box" size=".03 .03 .03"/></body></worldbody></mujoco>'
    yield (
        b'<mujoco><asset><mesh name="m" vertex="0 0 0 .1 0 0 0 .1 0 0 0 .1"/></asset><worldbody>'
        b'<geom type="mesh" mesh="m" mass="1"/><geom type="capsule" fromto="0 0 0 0 0 .1" size=".01"/>'
        b"</worldbody></mujoco>"
    )
    yield b'<mujoco><worldbody><replicate count="3" offset="1 0 0"><geom size=".01"/></replicate></worldbody></mujoco>'


def mutate(data: bytes, chance: random.Random) -> bytes | None:
    """Return another model."""
    return xml_trees.mutate(data, chance, TAGS, NAMES)


def attempt(data: bytes) -> None:
    """Build a cell with the model as a part and as furniture."""
    _MODEL.write_bytes(data)
    try:
        run(Cell(load_trial([_TRIAL]).trial))
    except DescriptionError as error:
        check_refusal(error, str(_TRIAL))
    except ModelFileError as error:
        check_lines([error], [str(_MODEL)])
    except SimulationError:
        pass
