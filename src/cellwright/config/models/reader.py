"""Reader of a trial's part types and furniture, from YAML shapes or model files."""

import math
import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, get_args

import numpy as np

from cellwright.config.footprints import PART_TYPES
from cellwright.config.models.files import ModelFileError, check_mjcf, open_model
from cellwright.config.models.meshes import MAX_SIZE, is_flat, read_mesh
from cellwright.config.models.model import Colour, Furniture, ModelShape, ModelShapeKind, UserModel
from cellwright.config.models.xml import MAX_SHAPES, read_xml
from cellwright.config.parsing import expressions
from cellwright.config.parsing.coordinates import coordinates
from cellwright.config.parsing.reader import MAX_MESH_BYTES, Keys, Read, Reader, one_of, section
from cellwright.config.parsing.schema import NUMBER, Elsewhere, Schema, accepts, array, bounded, mapping
from cellwright.config.parsing.tree import Entry, Items, Leaf, Table, YamlNode, describe
from cellwright.util.pose import Pose, Vector3

MIN_SIZE = 1e-4
"""Minimum length of a shape [m]."""
MAX_SCALE = 1e6

_FORMS: tuple[ModelShapeKind, ...] = get_args(ModelShapeKind)
_USES = ("both", "touched", "seen")
_LENGTH: Schema = {"type": "number", "minimum": MIN_SIZE, "maximum": MAX_SIZE}

MIN_MASS, MAX_MASS = 1e-3, 100.0
"""Bounds of a part's mass [kg]."""
MAX_PART_EXTENT = 0.22
"""Maximum distance of a part's surface from its origin [m]: waiting parts stand 0.45 m apart."""
MAX_FURNITURE = 200
MAX_TYPES = 200
"""Maximum number of user-defined part types."""
_COORDINATES = coordinates(3)
_RESERVED = frozenset({"kit_tray", "tray"})
"""Names of trays in what cameras report; those of AGVs are refused with the cell."""
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]+", re.ASCII)
_NUMBERED = re.compile(r".*(_\d+|_clone.*)")  # a part's type is its model name without these suffixes


@accepts(lambda: mapping(_PART.schema() | _exactly_one("shapes", "file")))
def read_part_models(reader: Reader, node: YamlNode) -> dict[str, UserModel]:
    """Return the user-defined part types by name."""
    table = reader.table(node)
    found: dict[str, UserModel] = {}
    if table and len(table.entries) > MAX_TYPES:
        reader.problems.error(node, f"too many part types (got {len(table.entries)}, at most {MAX_TYPES})")
        return {}
    for entry in table.entries.values() if table else ():
        name = reader.text_key(entry)
        body = reader.table(entry.value)
        if name is None or body is None:
            continue
        _check_name(name, entry, reader)
        model = _model(body, entry, reader, _PART.read(body, reader))
        if model is None:
            continue
        if model.mjcf is None and not any(shape.is_touched for shape in model.shapes):
            reader.problems.error(entry, "no collision shape, so the part would fall through the floor; add one")
        elif model.mjcf is None and model.mass is None:
            reader.problems.error(entry, "the required entry 'mass' [kg] is missing, and no model file has it")
        elif model.mass is not None and not MIN_MASS <= model.mass <= MAX_MASS:
            message = f"mass must be from {MIN_MASS:g} to {MAX_MASS:g} kg (got {model.mass:g})"
            reader.problems.error(body.entries.get("mass", entry), message)
        elif (farthest := max(map(extent, model.shapes), default=0.0)) > MAX_PART_EXTENT:
            message = f"must stay within {MAX_PART_EXTENT:g} m of its origin (got {farthest:.2f} m)"
            reader.problems.error(entry, message)
        else:
            found[name] = model
    return found


@accepts(lambda: array(_FURNITURE.schema() | _exactly_one("shapes", "file"), 0, MAX_FURNITURE))
def read_furniture(reader: Reader, node: YamlNode) -> tuple[Furniture, ...]:
    """Return the user-defined furniture."""
    if not isinstance(node, Items):
        reader.problems.error(node, f"must be a list (got {describe(node)})")
        return ()
    if len(node.items) > MAX_FURNITURE:
        reader.problems.error(node, f"too many pieces (got {len(node.items)}, at most {MAX_FURNITURE})")
        return ()
    found: dict[str, Furniture] = {}
    for item in node.items:
        expressions.check_expressions(item, reader.problems)
        table = reader.table(item)
        if table is None:
            continue
        values = _FURNITURE.read(table, reader)
        name, model = values.get("name"), _model(table, table, reader, values)
        if name is None or model is None:
            continue
        if name in found or "|" in name:
            message = "another piece has this name; choose another" if name in found else "a name must not contain |"
            reader.problems.error(table.entries["name"].value, message)
        found[name] = Furniture(name, model, values.get("pose", Pose()))
    return tuple(found.values())


@accepts(lambda: mapping(array(_PRIMITIVE.schema() | _exactly_one(*_PRIMITIVES), 0, MAX_SHAPES)))
def read_primitives(reader: Reader, node: YamlNode) -> dict[str, tuple[ModelShape, ...]] | None:
    """Return boxes, cylinders, capsules and spheres by the names of what they are of; None after an error.

    A name may have an empty list: nothing of it is touched.
    """
    table = reader.table(node)
    if table is None:
        return None
    errors = reader.problems.error_count
    found = {
        name: _shapes(entry.value, reader, _PRIMITIVE, 0)
        for entry in table.entries.values()
        if (name := reader.text_key(entry)) is not None
    }
    return None if reader.problems.error_count > errors else found


@accepts(array({"type": "number", "minimum": 0, "maximum": 1}, 3, 4))
def _colour(reader: Reader, node: YamlNode) -> Colour | None:
    """Return red, green, blue and opacity (1 if the file gives none)."""
    items = node.items if isinstance(node, Items) else ()
    numbers = [item.value for item in items if isinstance(item, Leaf) and isinstance(item.value, int | float)]
    if len(numbers) not in (3, 4) or len(numbers) != len(items) or not all(0 <= number <= 1 for number in numbers):
        reader.problems.error(node, "must be [red, green, blue] or [red, green, blue, opacity], each from 0 to 1")
        return None
    red, green, blue, *opacity = (float(number) for number in numbers)
    return (red, green, blue, opacity[0] if opacity else 1.0)


def _path(reader: Reader, node: YamlNode) -> Path | None:
    """Return a path; relative ones start from the folder of the YAML file."""
    if not isinstance(node, Leaf) or not isinstance(node.value, str) or not node.value.isprintable():
        reader.problems.error(node, f"must be the path of a file (got {describe(node)})")
        return None
    return Path(node.place.path).parent / node.value


@accepts({"type": "string"})
def _mesh(reader: Reader, node: YamlNode) -> Path | None:
    path = _path(reader, node)
    try:
        if path is not None:
            read_mesh(path)
    except ModelFileError as error:
        reader.problems.error(node, str(error))
        return None
    return path


@accepts(array(_LENGTH, 3))
def _lengths(reader: Reader, node: YamlNode) -> Vector3 | None:
    lengths = _COORDINATES(reader, node)
    return None if lengths is None else (float(lengths[0]), float(lengths[1]), float(lengths[2]))


@accepts({"anyOf": [array({"type": "number"}, 3), NUMBER]})
def _scale(reader: Reader, node: YamlNode) -> Vector3 | None:
    """Return the scale factors of a mesh: three numbers, or one for all axes."""
    if isinstance(node, Items):
        return _lengths(reader, node)
    factor = reader.number(node)
    return None if factor is None else (float(factor),) * 3


def _model(table: Table, where: Entry | Table, reader: Reader, values: Mapping[str, Any]) -> UserModel | None:
    """Return the model from the `shapes` or the `file` in a table, or None after an error.

    `values` are its `mass` and `color`, where the table has them; errors refer to `where`.
    """
    shapes, file = table.get("shapes"), table.get("file")
    if (shapes is None) == (file is None):
        reader.problems.error(where, "needs either 'shapes' or 'file'" + (", not both" if shapes else ""))
        return None
    errors = reader.problems.error_count
    model = _from_file(file, reader) if file else UserModel(_shapes(shapes, reader, _SHAPE) if shapes else ())
    if model is None or reader.problems.error_count > errors:
        return None
    return replace(model, mass=values.get("mass", model.mass), colour=values.get("color"))


def _from_file(node: YamlNode, reader: Reader) -> UserModel | None:
    path = _path(reader, node)
    if path is None:
        return None
    try:
        file = open_model(path)
        folder = path if path.is_dir() else path.parent
        if file.format == "mjcf":
            check_mjcf(file)
            return UserModel(mjcf=file.path)
        model = read_xml(file, folder)
    except (ModelFileError, OSError) as error:
        reader.problems.error(node, str(error))
        return None
    for shape in model.shapes:
        _check_size(shape, node, reader)
    return model


def _shapes(node: YamlNode, reader: Reader, keys: Keys, fewest: int = 1) -> tuple[ModelShape, ...]:
    """Return the shapes in a list, each with these keys."""
    if not isinstance(node, Items) or not fewest <= len(node.items) <= MAX_SHAPES:
        found = f"a list of {len(node.items)}" if isinstance(node, Items) else describe(node)
        reader.problems.error(node, f"must be a list of {fewest} to {MAX_SHAPES} shapes (got {found})")
        return ()
    shapes = []
    for item in node.items:
        expressions.check_expressions(item, reader.problems)
        table = reader.table(item)
        shape = _shape(table, reader, keys) if table else None
        if shape:
            shapes.append(shape)
    return tuple(shapes)


def _shape(table: Table, reader: Reader, keys: Keys) -> ModelShape | None:
    values, known = keys.read(table, reader), [name for name in _FORMS if name in keys.names]
    forms = [name for name in known if name in table]
    if len(forms) != 1:
        reader.problems.error(table, f"must have exactly one of {', '.join(known)} (got {', '.join(forms) or 'none'})")
        return None
    (form,) = forms
    if form != "mesh" and "scale" in table:
        reader.problems.error(table.entries["scale"], "only a mesh can have a scale; remove it")
    size, mesh = values.get(form), None
    if form == "mesh":
        size, mesh = values.get("scale", None if "scale" in table else (1.0, 1.0, 1.0)), size
    if size is None or form not in values:
        return None
    use, pose = values.get("use", "both"), values.get("pose", Pose())
    shape = ModelShape(form, size, pose, values.get("color"), use != "seen", use != "touched", mesh)
    _check_size(shape, table.entries[form], reader)
    return shape


def _check_size(shape: ModelShape, where: Entry | YamlNode, reader: Reader) -> None:
    """Report a shape that is flat, inverted or larger than a cell."""
    if shape.mesh is not None:
        if not reader.admit_mesh(shape.mesh):
            reader.problems.error(where, f"the meshes of the trial exceed {MAX_MESH_BYTES >> 20} MiB in total")
            return
        if not all(0 < factor <= MAX_SCALE for factor in shape.size):
            factors = ", ".join(f"{factor:g}" for factor in shape.size)
            reader.problems.error(where, f"scale must be above 0 and at most {MAX_SCALE:g} (got {factors})")
            return
        vertices = read_mesh(shape.mesh)[0] * shape.size
        lengths = (vertices.max(axis=0) - vertices.min(axis=0)).tolist()
        if is_flat(vertices):
            reader.problems.error(where, f"{shape.mesh}: the mesh is flat and has no volume")
            return
    else:
        count = {"box": 3, "sphere": 1}.get(shape.kind, 2)
        lengths = list(shape.size[:count])
    if not all(MIN_SIZE <= length <= MAX_SIZE for length in lengths):
        shown = " x ".join(f"{length:g}" for length in lengths)
        message = f"lengths of a {shape.kind} must be from {MIN_SIZE:g} to {MAX_SIZE:g} m (got {shown})"
        hint = "; for a mesh in millimetres write scale: 0.001" if shape.mesh and max(lengths) > MAX_SIZE else ""
        reader.problems.error(where, message + hint)


def extent(shape: ModelShape) -> float:
    """Return the maximum distance of a shape from its model's origin [m]; for a mesh, that of its farthest vertex."""
    x, y, z = shape.size
    away = math.hypot(*shape.pose.position)
    match shape.kind:
        case "mesh" if shape.mesh is not None:
            return away + float(np.linalg.norm(read_mesh(shape.mesh)[0] * shape.size, axis=1).max())
        case "box":
            return away + math.hypot(x, y, z) / 2
        case "sphere":
            return away + x
        case _:
            return away + math.hypot(x, y / 2) + (x if shape.kind == "capsule" else 0.0)


def _check_name(name: str, entry: Entry, reader: Reader) -> None:
    if not _NAME.fullmatch(name) or _NUMBERED.fullmatch(name):
        message = "a part type must be letters, digits and _, with a letter first and no _NUMBER or _clone at the end"
        reader.problems.error(entry, message)
    elif name in PART_TYPES or name in _RESERVED:
        reader.problems.error(entry, f"the model name {name!r} is in use; choose another")


@accepts(bounded(NUMBER, MIN_MASS, MAX_MASS))
def _mass(reader: Reader, node: YamlNode) -> float | None:
    """Return a mass [kg], which is judged with the part."""
    return reader.number(node)


def _exactly_one(*names: str) -> Schema:
    return {"oneOf": [{"required": [name]} for name in names]}


@accepts(_LENGTH)
def _length(reader: Reader, node: YamlNode) -> float | None:
    """Return a length, which is judged with the others of its shape."""
    return reader.number(node)


_ROUND: Read = section(
    Keys({"radius": _length, "length": _length}, strict="entry"),
    lambda radius, length: (float(radius), float(length), 0.0),
)
_SPHERE: Read = section(Keys({"radius": _length}, strict="entry"), lambda radius: (float(radius), 0.0, 0.0))
_PRIMITIVES: Mapping[str, Read] = {"box": _lengths, "cylinder": _ROUND, "capsule": _ROUND, "sphere": _SPHERE}
_PRIMITIVE: Keys = Keys(optional={**_PRIMITIVES, "pose": Reader.pose}, strict="entry")
_SHAPE: Keys = Keys(
    optional={
        **_PRIMITIVES,
        "mesh": _mesh,
        "pose": Reader.pose,
        "color": _colour,
        "scale": _scale,
        "use": one_of(_USES, "use"),
    },
    strict="entry",
)
_MODEL: Mapping[str, "Read | Elsewhere"] = {
    "color": _colour,
    "shapes": Elsewhere(lambda: array(_SHAPE.schema() | _exactly_one(*_FORMS), 1, MAX_SHAPES)),
    "file": Elsewhere({"type": "string"}),
}
"""Shapes or a file, of which exactly one is there, and a colour."""
_PART: Keys = Keys(optional={"mass": _mass, **_MODEL}, strict="entry")
_FURNITURE: Keys = Keys({"name": Reader.name}, {"pose": Reader.pose, **_MODEL}, "entry")
