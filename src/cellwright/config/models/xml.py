"""Reader of a model's shapes and mass from SDF and URDF: collision and visual shapes, and their poses.

A model is one rigid body: its links are merged in place, and movable joints are refused. Of an inertia, only the mass
counts. Shapes are boxes, cylinders, capsules, spheres and meshes.
"""

import math
import xml.etree.ElementTree as ET
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import ClassVar, cast, get_args

from cellwright.config.models.files import ModelFile, ModelFileError, referenced_file
from cellwright.config.models.meshes import read_mesh
from cellwright.config.models.model import Colour, ModelShape, ModelShapeKind, UserModel, clipped_colour
from cellwright.util.pose import Pose, Vector3, normalized

MAX_SHAPES = 200
"""Maximum number of shapes of one model."""
MAX_LINKS = 300
"""Maximum number of links of one model."""
URDF_VERSIONS = ("1.0", "1", "1.1", "1.2")
"""Known versions of URDF: 1.1 adds the capsule, 1.2 `quat_xyzw`."""


def read_xml(file: ModelFile, folder: Path) -> UserModel:
    """Return the model in an SDF or URDF file; meshes must lie in `folder`.

    Raises:
        ModelFileError: the model has unsupported content, or no shapes or mass.
    """
    count = sum(1 for tag in ("collision", "visual") for _ in file.root.iter(tag))
    if count > MAX_SHAPES:
        raise ModelFileError(f"{file.path}: too many shapes (got {count}, at most {MAX_SHAPES})")
    reader = _Sdf(file.path, folder) if file.format == "sdf" else _Urdf(file.path, folder)
    mass, shapes = reader.read(file.root)
    if not shapes:
        raise ModelFileError(f"{file.path}: no collision or visual shape")
    # without visual shapes, the collision shapes are drawn
    if not any(shape.is_seen for shape in shapes):
        shapes = [ModelShape(each.kind, each.size, each.pose, each.colour, mesh=each.mesh) for each in shapes]
    return UserModel(tuple(shapes), mass or None)


class _XmlModelReader:
    """Base of the SDF and URDF readers, which differ in how they write a shape's figures and name a mesh file."""

    figure: Callable[[ET.Element, str], str | None]
    reference: ClassVar[str]

    def __init__(self, path: Path, folder: Path) -> None:
        self.path = path
        self.folder = folder

    def refuse(self, message: str) -> ModelFileError:
        return ModelFileError(f"{self.path}: {message}")

    def numbers(self, text: str | None, count: int, kind: str) -> list[float]:
        """Return exactly `count` finite numbers."""
        try:
            found = [float(word) for word in (text or "").split()]
        except ValueError:
            found = []
        if len(found) != count or not all(map(math.isfinite, found)):
            raise self.refuse(f"{kind} must be {count} finite number{'s' if count > 1 else ''} (got {text!r})")
        return found

    def vector(self, text: str | None, kind: str) -> Vector3:
        x, y, z = self.numbers(text, 3, kind)
        return (x, y, z)

    def refuse_moving(self, joints: Iterable[ET.Element]) -> None:
        """Refuse a model with a movable joint."""
        for joint in joints:
            if joint.get("type") != "fixed":
                raise self.refuse(f"joint {joint.get('name')!r} is not fixed; a model must be one rigid body")

    def shape(self, element: ET.Element, pose: Pose, colour: Colour | None) -> ModelShape:
        """Return the shape of a `<collision>` or `<visual>`."""
        geometry = element.find("geometry")
        form = next(iter(geometry), None) if geometry is not None else None
        if form is None:
            name = f" name={element.get('name')!r}" if element.get("name") else ""
            raise self.refuse(f"<{element.tag}{name}> has no <geometry>")
        if form.tag not in get_args(ModelShapeKind):
            raise self.refuse(f"shape <{form.tag}> is not supported (known: {', '.join(get_args(ModelShapeKind))})")
        size, file = self._size(form)
        touched = element.tag == "collision"
        return ModelShape(cast("ModelShapeKind", form.tag), size, pose, colour, touched, not touched, file)

    def _size(self, form: ET.Element) -> tuple[Vector3, Path | None]:
        """Return the lengths of a shape, or the scale factors and file of a mesh."""
        if form.tag == "box":
            return self.vector(self.figure(form, "size"), "size"), None
        if form.tag != "mesh":
            radius = self.numbers(self.figure(form, "radius"), 1, "radius")[0]
            length = 0.0 if form.tag == "sphere" else self.numbers(self.figure(form, "length"), 1, "length")[0]
            return (radius, length, 0.0), None
        reference, scale = self.figure(form, self.reference), self.figure(form, "scale")
        if not reference:
            raise self.refuse(f"a mesh has no {self.reference}")
        file = referenced_file(self.path, reference, self.folder)
        read_mesh(file)
        return self.vector(scale, "scale") if scale else (1.0, 1.0, 1.0), file


class _Sdf(_XmlModelReader):
    figure = staticmethod(ET.Element.findtext)
    reference = "uri"

    def read(self, root: ET.Element) -> tuple[float, list[ModelShape]]:
        """Return the mass [kg] and the shapes, in the frame of the model."""
        models = [*root.findall("model"), *root.findall("world/model")]
        if len(models) != 1:
            raise self.refuse(f"must have exactly one model (got {len(models)})")
        (model,) = models
        for element in model.iter():
            if element.tag in ("include", "plugin", "sensor"):
                raise self.refuse(f"<{element.tag}> is not supported; a model can have only shapes")
        self.refuse_moving(model.iter("joint"))
        mass, shapes = 0.0, list[ModelShape]()
        for link in model.findall("link"):
            place = self._pose(model) @ self._pose(link)
            mass += self.numbers(link.findtext("inertial/mass", "0"), 1, "mass")[0]
            found = (*link.findall("collision"), *link.findall("visual"))
            shapes += [self.shape(each, place @ self._pose(each), self._colour(each)) for each in found]
        return mass, shapes

    def _pose(self, element: ET.Element) -> Pose:
        text = element.findtext("pose")
        if text is None or not text.strip():
            return Pose()
        x, y, z, roll, pitch, yaw = self.numbers(text, 6, "pose")
        return Pose.from_rpy((x, y, z), (roll, pitch, yaw))

    def _colour(self, element: ET.Element) -> Colour | None:
        text = element.findtext("material/diffuse")
        if text is None:
            return None
        numbers = self.numbers(text if len(text.split()) == 4 else f"{text} 1", 4, "diffuse")
        return clipped_colour(numbers)


class _Urdf(_XmlModelReader):
    figure = staticmethod(ET.Element.get)
    reference = "filename"

    def read(self, root: ET.Element) -> tuple[float, list[ModelShape]]:
        """Return the mass [kg] and the shapes, in the frame of the model."""
        if (version := root.get("version", "1.0").strip()) not in URDF_VERSIONS:
            raise self.refuse(f"unknown version {version!r} of URDF (known: {', '.join(URDF_VERSIONS)})")
        places = self._places(root)
        colours = {material.get("name"): self._rgba(material) for material in root.findall("material")}
        mass, shapes = 0.0, []
        for link in root.findall("link"):
            weight = link.find("inertial/mass")
            mass += self.numbers(weight.get("value"), 1, "mass")[0] if weight is not None else 0.0
            for element in (*link.findall("collision"), *link.findall("visual")):
                pose = places[link.get("name", "")] @ self._origin(element)
                material = element.find("material")
                colour = None if material is None else self._rgba(material) or colours.get(material.get("name"))
                shapes.append(self.shape(element, pose, colour))
        return mass, shapes

    def _places(self, root: ET.Element) -> dict[str, Pose]:
        """Return the pose of each link in the frame of the model, from the fixed joints between them."""
        parents: dict[str, tuple[str, Pose]] = {}
        self.refuse_moving(root.findall("joint"))
        for joint in root.findall("joint"):
            parent, child = joint.find("parent"), joint.find("child")
            if parent is None or child is None:
                raise self.refuse(f"joint {joint.get('name')!r} has no parent or no child")
            parents[child.get("link", "")] = (parent.get("link", ""), self._origin(joint))
        names = {link.get("name", ""): None for link in root.findall("link")}
        if len(names) > MAX_LINKS:
            raise self.refuse(f"too many links (got {len(names)}, at most {MAX_LINKS})")
        return {name: self._place(name, parents, names) for name in names}

    def _place(self, name: str, parents: dict[str, tuple[str, Pose]], names: Mapping[str, None]) -> Pose:
        place, path = Pose(), [name]
        while name in parents:
            name, origin = parents[name]
            if name in path or name not in names:
                raise self.refuse(
                    f"link {path[0]!r} has no path to a root link (the joint of {path[-1]!r} leads to {name!r})"
                )
            path.append(name)
            place = origin @ place
        return place

    def _origin(self, element: ET.Element) -> Pose:
        origin = element.find("origin")
        if origin is None:
            return Pose()
        xyz = self.vector(origin.get("xyz", "0 0 0"), "xyz")
        if (written := origin.get("quat_xyzw")) is None:
            return Pose.from_rpy(xyz, self.vector(origin.get("rpy", "0 0 0"), "rpy"))
        x, y, z, w = self.numbers(written, 4, "quat_xyzw")
        if "rpy" in origin.attrib or not 1e-6 < math.hypot(x, y, z, w) < 1e6:
            raise self.refuse(f"quat_xyzw must be a unit quaternion, without rpy beside it (got {written!r})")
        return Pose(xyz, normalized((w, x, y, z)))

    def _rgba(self, material: ET.Element) -> Colour | None:
        colour = material.find("color")
        return None if colour is None else clipped_colour(self.numbers(colour.get("rgba"), 4, "rgba"))
