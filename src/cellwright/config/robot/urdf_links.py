"""Links of a URDF: mass, shapes and colours, and simple shapes in place of missing meshes."""

import math
from collections.abc import Collection, Iterable
from dataclasses import replace
from enum import Enum
from typing import cast, get_args

import numpy as np

from cellwright.config.models.model import Colour, ModelShape, ModelShapeKind, clipped_colour
from cellwright.config.parsing.tree import Definition, shortened
from cellwright.config.robot.meshes import MeshFinder
from cellwright.config.robot.model import Inertial, Joint, Link
from cellwright.config.robot.urdf_file import Element
from cellwright.config.robot.urdf_numbers import Numbers
from cellwright.util.errors import suggestion
from cellwright.util.pose import Pose, Quaternion, Vector3, normalized

NEAR = 0.02
"""Distance [m] from the origin of a link within which joints do not define its form."""
THICKNESS = (0.08, 0.3)
"""Minimum and maximum radius of a limb, as a share of its length."""
DENSITY = 1200.0
"""Rough density of a robot's links [kg/m^3], which gives the thickness of a limb from the mass of its link."""

_DEFAULT_RADIUS_SHARE = 0.16  # radius of a limb of unknown mass, as a share of its length
_MIN_RADIUS, _MAX_RADIUS = 0.005, 0.12  # radius [m]
MAX_MASS = 1e6
"""Maximum valid mass [kg]."""
MAX_LENGTH = 1e4
"""Maximum valid length of a shape [m]."""
_FORMS: tuple[str, ...] = get_args(ModelShapeKind)
_DENSITY = 1000.0  # of the ball that replaces an impossible inertia [kg/m^3]
_INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


class Use(Enum):
    """Purpose of a shape."""

    SEEN = "seen"
    TOUCHED = "touched"


def with_stand_ins(link: Link, joints: Iterable[Joint], missing_uses: Collection[Use]) -> Link:
    """Return a link with all shapes that it needs for display and collision.

    Shapes for one purpose serve the other if it has none. A link without any shape gets limbs: capsules from its origin
    to each joint that it carries, or a ball around its centre of mass. The link comes without its unreadable shapes;
    `missing_uses` are the purposes of those.
    """
    seen = any(shape.is_seen for shape in link.shapes)
    touched = any(shape.is_touched for shape in link.shapes)
    is_seen, is_touched = Use.SEEN in missing_uses and not seen, Use.TOUCHED in missing_uses and not touched
    if not (is_seen or is_touched):
        return link
    if link.shapes:
        both = tuple(
            replace(shape, is_seen=shape.is_seen or is_seen, is_touched=shape.is_touched or is_touched)
            for shape in link.shapes
        )
        return replace(link, shapes=both)
    limbs = _limbs(link, list(joints))
    return replace(link, shapes=tuple(replace(limb, is_seen=is_seen, is_touched=is_touched) for limb in limbs))


def _limbs(link: Link, joints: list[Joint]) -> list[ModelShape]:
    mass = link.inertial.mass if link.inertial is not None else 0.0
    ends = [joint.origin.position for joint in joints if joint.parent == link.name]
    ends = [end for end in dict.fromkeys(ends) if math.hypot(*end) > NEAR]
    if ends:
        return [_limb(end, mass / len(ends)) for end in ends]
    middle = link.inertial.pose.position if link.inertial is not None else (0.0, 0.0, 0.0)
    # without child joints: as far beyond the centre of mass as before it
    if math.hypot(*middle) > NEAR / 2:
        x, y, z = middle
        return [_limb((2 * x, 2 * y, 2 * z), mass)]
    above = next((math.hypot(*joint.origin.position) for joint in joints if joint.child == link.name), 0.0)
    radius = (3 * mass / (4 * math.pi * DENSITY)) ** (1 / 3) or _DEFAULT_RADIUS_SHARE * above
    return [ModelShape("sphere", (_clamped(radius, _MIN_RADIUS, _MAX_RADIUS), 0.0, 0.0), Pose(middle))]


def _limb(end: Vector3, mass: float) -> ModelShape:
    """Return a capsule from the origin to a point [m], with a thickness that follows from its mass [kg]."""
    length = math.hypot(*end)
    radius = math.sqrt(mass / (DENSITY * math.pi * length)) or _DEFAULT_RADIUS_SHARE * length
    thin, thick = THICKNESS
    radius = _clamped(_clamped(radius, thin * length, thick * length), _MIN_RADIUS, _MAX_RADIUS)
    x, y, z = end
    pose = Pose((x / 2, y / 2, z / 2), _turn_z_to((x / length, y / length, z / length)))
    return ModelShape("capsule", (radius, max(length - radius, length / 2), 0.0), pose)


def _turn_z_to(direction: Vector3) -> Quaternion:
    """Return the shortest rotation of the z axis to a unit vector."""
    x, y, z = direction
    return normalized((1 + z, -y, x, 0.0)) if z > -1 + 1e-9 else (0.0, 1.0, 0.0, 0.0)


def _clamped(value: float, minimum: float, maximum: float) -> float:
    return max(minimum, min(value, maximum))


class LinkReader:
    """Reader of single links."""

    def __init__(self, numbers: Numbers, meshes: MeshFinder) -> None:
        self._numbers = numbers
        self._problems = numbers.problems
        self._meshes = meshes
        self._colours: dict[str, Colour] = {}
        self.without_inertia: list[str] = []
        """Links with a mass and an impossible inertia; they turn like a ball of water."""
        self.missing_uses: dict[str, set[Use]] = {}
        """Links with an unusable mesh, and its purposes."""

    def read_materials(self, robot: Element) -> None:
        """Store the named colours, wherever they are defined; the first of a name counts."""
        visuals = [visual for link in robot.all("link") for visual in link.all("visual")]
        for material in (material for owner in (robot, *visuals) for material in owner.all("material")):
            name, colour = material.get("name"), self._rgba(material)
            if name is not None and colour is not None:
                self._colours.setdefault(name, colour)

    def read(self, element: Element, name: str) -> Link:
        """Return the link in an element, without shapes whose mesh is unusable; `missing_uses` records those."""
        shapes = [self._shape(each, name) for each in (*element.all("collision"), *element.all("visual"))]
        found = tuple(shape for shape in shapes if shape is not None)
        return Link(name, self._inertial(element, name), found, Definition(element.place, element.key))

    def _inertial(self, link: Element, name: str) -> Inertial | None:
        """Return mass and inertia; that of a ball replaces an impossible inertia."""
        element = link.find("inertial")
        if element is None:
            return None
        pose = self._numbers.pose(element)
        written = element.find("mass")
        if written is None or written.get("value") is None:
            self._problems.error(written or element, '<inertial> requires <mass value="…"/> [kg]')
            return None
        mass = self._numbers.number(written, "value", 0.0)
        if not 0.0 <= mass <= MAX_MASS:
            self._problems.error(written, f"mass must be from 0 to {MAX_MASS:g} kg (got {mass:g})")
            return None
        moments = element.find("inertia")
        xx, yy, zz, xy, xz, yz = (self._numbers.number(moments, name, 0.0) if moments else 0.0 for name in _INERTIA)
        inertia = (xx, yy, zz, xy, xz, yz)
        if mass == 0:
            return Inertial(0.0, pose)
        if not _is_valid_inertia(*inertia):
            self.without_inertia.append(name)
            inertia = _sphere_inertia(mass)
        return Inertial(mass, pose, inertia)

    def _shape(self, element: Element, link: str) -> ModelShape | None:
        pose = self._numbers.pose(element)
        geometry = element.find("geometry")
        form = next((child for child in geometry.children if child.tag in _FORMS), None) if geometry else None
        if form is None:
            other = geometry.children[0].tag if geometry and geometry.children else None
            content = f"unknown shape <{shortened(other)}>" if other else f"<{element.tag}> has no shape"
            self._problems.warn(geometry or element, f"{content}, ignored{suggestion(other or '', _FORMS)}")
            return None
        colour, is_touched, path = self._colour(element), element.tag == "collision", None
        if form.tag != "mesh":
            size = self._size(form)
        elif (reference := form.get("filename")) is None:
            self._problems.error(form, '<mesh> requires filename="…"')
            return None
        else:
            path, size = self._meshes.find(reference), self._scale(form)
            if path is None:
                self.missing_uses.setdefault(link, set()).add(Use.TOUCHED if is_touched else Use.SEEN)
                return None
            self._meshes.check_length(reference, path, size)
        kind = cast("ModelShapeKind", form.tag)
        return ModelShape(kind, size, pose, colour, is_touched, not is_touched, path) if size else None

    def _size(self, form: Element) -> Vector3 | None:
        """Return the size as `ModelShape` has it; None for an invalid shape, which is reported."""
        names = {"box": ("size",), "sphere": ("radius",)}.get(form.tag, ("radius", "length"))
        missing = [name for name in names if form.get(name) is None]
        if missing:
            self._problems.error(form, f"<{form.tag}> requires {' and '.join(missing)} [m]")
            return None
        if form.tag == "box":
            size = self._numbers.vector(form, "size")
            lengths: tuple[float, ...] = size
        else:
            lengths = tuple(self._numbers.number(form, name, 0.0) for name in names)
            size = (lengths[0], lengths[1] if len(lengths) > 1 else 0.0, 0.0)
        if not all(0.0 < value <= MAX_LENGTH for value in lengths):
            shown = " ".join(f"{value:g}" for value in lengths)
            self._problems.warn(
                form, f"lengths must be above 0 and at most {MAX_LENGTH:g} m (got {shown}); the {form.tag} is ignored"
            )
            return None
        return size

    def _scale(self, form: Element) -> Vector3:
        written = (form.get("scale") or "").split()
        # PyBullet applies a single factor to all three axes
        if len(written) == 1:
            factor = self._numbers.number(form, "scale", 1.0)
            scale: Vector3 = (factor, factor, factor)
        else:
            scale = self._numbers.vector(form, "scale", (1.0, 1.0, 1.0))
        if not all(1e-9 < abs(value) < 1e9 for value in scale):
            self._problems.error(form, "scale must be above 1e-09 and below 1e+09 in magnitude")
        return scale

    def _colour(self, element: Element) -> Colour | None:
        material = element.find("material")
        if material is None:
            return None
        return self._rgba(material) or self._colours.get(material.get("name") or "")

    def _rgba(self, material: Element) -> Colour | None:
        colour = material.find("color")
        found = self._numbers.read(colour, "rgba", 4) if colour else None
        return clipped_colour(found) if found else None


def _sphere_inertia(mass: float) -> tuple[float, float, float, float, float, float]:
    """Return the inertia [kg m^2] of a ball of this mass [kg]."""
    radius = (3.0 * mass / (4.0 * np.pi * _DENSITY)) ** (1 / 3)
    inertia = 0.4 * mass * radius**2
    return (inertia, inertia, inertia, 0.0, 0.0, 0.0)


def _is_valid_inertia(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float) -> bool:
    """Return whether an inertia resists every rotation."""
    with np.errstate(all="ignore"):
        moments = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    return bool(moments[0] > 0 and moments[2] < MAX_MASS * MAX_LENGTH)
