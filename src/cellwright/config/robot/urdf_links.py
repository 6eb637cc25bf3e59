"""The `<link>` elements of a URDF file: mass, shapes and colours."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TypeAlias

import numpy as np

from cellwright.config.models.model import Colour, ModelShape, ModelShapeKind
from cellwright.config.parsing.tree import shortened
from cellwright.config.robot.meshes import MeshFinder
from cellwright.config.robot.model import Inertial, Link
from cellwright.config.robot.stand_ins import Use
from cellwright.config.robot.urdf_file import Element
from cellwright.config.robot.urdf_numbers import Numbers
from cellwright.util.errors import did_you_mean
from cellwright.util.pose import Pose, Vector3

HEAVIEST = 1e6
"""Largest mass that means anything [kg]."""
LARGEST = 1e4
"""Largest length of a shape that means anything [m]."""

_FORMS: dict[str, ModelShapeKind] = {
    "box": "box",
    "cylinder": "cylinder",
    "capsule": "capsule",
    "sphere": "sphere",
    "mesh": "mesh",
}
Inertia: TypeAlias = tuple[float, float, float, float, float, float]
"""ixx, iyy, izz, ixy, ixz, iyz [kg m^2]."""

_NONE: Inertia = (0.0,) * 6
_DENSITY = 1000.0  # of the ball that stands in for an inertia that cannot be [kg/m^3]
_INERTIA = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


class LinkReader:
    """Reads links one by one.

    Args:
        numbers: reads attributes, and collects what is wrong.
        meshes: finds the files of meshes, and keeps count of those that cannot be used.
    """

    def __init__(self, numbers: Numbers, meshes: MeshFinder) -> None:
        self._numbers = numbers
        self._problems = numbers.problems
        self._meshes = meshes
        self._colours: dict[str, Colour] = {}
        self.without_inertia: list[str] = []
        """Links with a mass and an inertia that no body has; they turn like a ball of water."""
        self.lacking: dict[str, set[Use]] = {}
        """Links with a mesh that cannot be used, and what it would have been used for."""

    def read_materials(self, robot: Element) -> None:
        """Remember the colours that have names, wherever they are defined; the first of a name counts."""
        inside = [
            material
            for link in robot.all("link")
            for visual in link.all("visual")
            for material in visual.all("material")
        ]
        for material in (*robot.all("material"), *inside):
            name, colour = material.get("name"), self._rgba(material)
            if name is not None and colour is not None:
                self._colours.setdefault(name, colour)

    def read(self, element: Element, name: str) -> Link:
        """The link in an element; shapes whose mesh cannot be used are left out, and the link is noted for it."""
        touched = self._shapes(element.all("collision"), name, is_touched=True)
        seen = self._shapes(element.all("visual"), name, is_touched=False)
        return Link(name, self._inertial(element, name), tuple(touched + seen))

    # ---------------------------------------------------------------- mass

    def _inertial(self, link: Element, name: str) -> Inertial | None:
        """Mass and inertia; one that no body has is replaced by that of a ball."""
        element = link.find("inertial")
        if element is None:
            return None
        pose = self._numbers.pose(element)
        written = element.find("mass")
        if written is None or written.get("value") is None:
            self._problems.error(written or element, '<inertial> needs <mass value="…"/> [kg]')
            return None
        mass = self._numbers.number(written, "value", 0.0)
        if not 0.0 <= mass <= HEAVIEST:
            self._problems.error(written, f"a mass of {mass:g} kg; 0 to {HEAVIEST:g} kg make sense")
            return None
        inertia = self._inertia(element)
        if mass == 0:
            return Inertial(0.0, pose)
        if not _is_possible(*inertia):
            self.without_inertia.append(name)
            inertia = _of_a_ball(mass)
        return Inertial(mass, pose, inertia)

    def _inertia(self, element: Element) -> Inertia:
        written = element.find("inertia")
        if written is None:
            return _NONE
        xx, yy, zz, xy, xz, yz = (self._numbers.number(written, name, 0.0) for name in _INERTIA)
        return (xx, yy, zz, xy, xz, yz)

    # ---------------------------------------------------------------- shapes

    def _shapes(self, elements: Iterable[Element], link: str, *, is_touched: bool) -> list[ModelShape]:
        found = [self._shape(element, link, is_touched=is_touched) for element in elements]
        return [shape for shape in found if shape is not None]

    def _shape(self, element: Element, link: str, *, is_touched: bool) -> ModelShape | None:
        pose = self._numbers.pose(element)
        geometry = element.find("geometry")
        form = next((child for child in geometry.children if child.tag in _FORMS), None) if geometry else None
        if form is None:
            other = geometry.children[0].tag if geometry and geometry.children else None
            what = f"a shape <{shortened(other)}>" if other else f"<{element.tag}> without a shape"
            hint = did_you_mean(other or "", _FORMS) or f" (known: {', '.join(_FORMS)})"
            self._problems.warn(geometry or element, f"{what} is left out{hint}")
            return None
        if form.tag == "mesh":
            return self._mesh(form, pose, self._colour(element), link, is_touched=is_touched)
        size = self._size(form)
        if size is None:
            return None
        return ModelShape(_FORMS[form.tag], size, pose, self._colour(element), is_touched, not is_touched)

    def _size(self, form: Element) -> Vector3 | None:
        """The size as `ModelShape` has it; None where a shape is nothing, which is told."""
        names = {"box": ("size",), "sphere": ("radius",)}.get(form.tag, ("radius", "length"))
        missing = [name for name in names if form.get(name) is None]
        if missing:
            self._problems.error(form, f"<{form.tag}> needs {' and '.join(missing)} [m]")
            return None
        if form.tag == "box":
            size = self._numbers.vector(form, "size")
            needed: tuple[float, ...] = size
        else:
            needed = tuple(self._numbers.number(form, name, 0.0) for name in names)
            size = (needed[0], needed[1] if len(needed) > 1 else 0.0, 0.0)
        if not all(0.0 < value <= LARGEST for value in needed):
            given = " ".join(f"{value:g}" for value in needed)
            self._problems.warn(form, f"a {form.tag} of {given} m is left out; lengths are above 0")
            return None
        return size

    def _mesh(
        self, form: Element, pose: Pose, colour: Colour | None, link: str, *, is_touched: bool
    ) -> ModelShape | None:
        reference = form.get("filename")
        if reference is None:
            self._problems.error(form, '<mesh> needs filename="…"')
            return None
        path = self._meshes.find(reference)
        scale = self._scale(form)
        if path is None:
            self.lacking.setdefault(link, set()).add(Use.TOUCHED if is_touched else Use.SEEN)
            return None
        return ModelShape("mesh", scale, pose, colour, is_touched, not is_touched, path)

    def _scale(self, form: Element) -> Vector3:
        written = (form.get("scale") or "").split()
        if len(written) == 1:  # PyBullet takes one factor for all three
            factor = self._numbers.number(form, "scale", 1.0)
            scale: Vector3 = (factor, factor, factor)
        else:
            scale = self._numbers.vector(form, "scale", (1.0, 1.0, 1.0))
        if not all(1e-9 < abs(value) < 1e9 for value in scale):
            self._problems.error(form, "a scale of 0 or beyond all sense")
        return scale

    # ---------------------------------------------------------------- colours

    def _colour(self, element: Element) -> Colour | None:
        material = element.find("material")
        if material is None:
            return None
        return self._rgba(material) or self._colours.get(material.get("name") or "")

    def _rgba(self, material: Element) -> Colour | None:
        colour = material.find("color")
        found = self._numbers.read(colour, "rgba", 4) if colour else None
        if not found:
            return None
        red, green, blue, opacity = (min(max(value, 0.0), 1.0) for value in found)
        return (red, green, blue, opacity)


def _of_a_ball(mass: float) -> Inertia:
    """The inertia [kg m^2] of a ball of this mass [kg]."""
    radius = (3.0 * mass / (4.0 * np.pi * _DENSITY)) ** (1 / 3)
    inertia = 0.4 * mass * radius**2
    return (inertia, inertia, inertia, 0.0, 0.0, 0.0)


def _is_possible(xx: float, yy: float, zz: float, xy: float, xz: float, yz: float) -> bool:
    """Whether an inertia resists every turn."""
    with np.errstate(all="ignore"):
        moments = np.linalg.eigvalsh(np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
    return bool(moments[0] > 0 and moments[2] < HEAVIEST * LARGEST)
