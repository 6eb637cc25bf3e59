"""Text of a robot's URDF for other programs, as the parameter `robot_description` has it.

ROS's own parser, urdfdom, refuses much of what the reader here tolerates or completes: a missing effort limit, numbers
between commas, version 1.2. So the text has the values as they were read. What only other programs read stays as it is.
Paths of meshes become absolute: programs that get only the text, such as rviz, would find none.
"""

import math
import re
from collections.abc import Iterable
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, TreeBuilder, tostring
from xml.parsers import expat

from cellwright.config.models.files import FileReference
from cellwright.config.models.model import clipped_colour
from cellwright.config.parsing.tree import Place, Problems, refusal
from cellwright.config.robot import urdf_file
from cellwright.config.robot.meshes import MeshFinder
from cellwright.config.robot.model import JointType, Link, RobotModel
from cellwright.config.robot.urdf_numbers import Numbers
from cellwright.config.robot.urdf_writer import rpy_of
from cellwright.util.pose import Pose

_NO_LIMIT = 1e9  # [rad; m; N m; N; rad/s; m/s]; urdfdom reads no infinite number
_COUNTS = {  # numbers in the attributes of elements, wherever they are
    "origin": {"xyz": 3, "rpy": 3, "quat_xyzw": 4},
    "axis": {"xyz": 3},
    "limit": dict.fromkeys(("lower", "upper", "effort", "velocity"), 1),
    "mimic": dict.fromkeys(("multiplier", "offset"), 1),
    "dynamics": dict.fromkeys(("damping", "friction"), 1),
    "safety_controller": dict.fromkeys(("soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"), 1),
    "calibration": dict.fromkeys(("rising", "falling", "reference_position"), 1),
    "mass": {"value": 1},
    "inertia": dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), 1),
    "box": {"size": 3},
    "sphere": {"radius": 1},
    "cylinder": {"radius": 1, "length": 1},
    "capsule": {"radius": 1, "length": 1},
    "mesh": {"scale": 3},
    "color": {"rgba": 4},
}
_NAMES = ("name", "type", "link", "joint")
_PLAIN = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?", re.ASCII)
_INERTIA = tuple(_COUNTS["inertia"])
_FORMS = ("box", "sphere", "cylinder", "capsule", "mesh")


def description(text: str, robot: RobotModel, path: Path) -> str:
    """Return the text of the URDF at a path, which was read as `robot`, in a form that ROS's own parser accepts.

    Missing meshes stay as written, and so do those of real packages, which ROS finds on other machines too.

    Raises:
        DescriptionError: the text is no XML.
    """
    root = _parsed(text, path)
    root.attrib.setdefault("name", robot.name)
    root.attrib["name"] = root.attrib["name"].strip() or robot.name
    root.attrib.pop("version", None)
    finder = MeshFinder(path)
    _mend_materials(root)
    for element in root.findall("link"):
        _mend_numbers(element)
        _mend_inertial(element, robot.links.get(element.get("name", "")))
        _mend_shapes(element, finder)
    for element in root.findall("joint"):
        _mend_numbers(element)
        _mend_joint(element)
    return tostring(root, encoding="unicode")


def in_first_version(root: Element) -> None:
    """Turn a URDF 1.2 into 1.0, which all readers know: roll, pitch, yaw for quaternions, cylinders for capsules."""
    root.attrib.pop("version", None)
    for link in root.findall("link"):
        for place, owner in reversed(list(enumerate(link))):
            if (capsule := owner.find("geometry/capsule")) is not None:
                _replace_capsule(link, place, owner, capsule)
    for owner in root.iter():
        _mend_origin(owner)


def _parsed(text: str, path: Path) -> Element:
    """Return the root element; prefixes of names, declared or not, stay as they are."""
    builder, parser = TreeBuilder(), expat.ParserCreate("utf-8")
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    try:
        parser.Parse(text.encode("utf-8", errors="replace"), True)
    except expat.ExpatError as error:  # the file has changed since it was read
        raise refusal(path, error.lineno, f"invalid XML: {expat.ErrorString(error.code)}") from None
    return builder.close()


def _mend_numbers(owner: Element) -> None:
    """Write numbers as they were read, where urdfdom reads them otherwise or not at all; drop those without use."""
    for element in owner.iter():
        for name in _NAMES:
            if name in element.attrib:
                element.attrib[name] = element.attrib[name].strip()
        for name, count in _COUNTS.get(element.tag, {}).items():
            written = element.attrib.get(name)
            if written is None or (len(words := written.split()) == count and all(map(_is_plain, words))):
                continue
            numbers = _numbers(element, name, count)
            if numbers is None:
                del element.attrib[name]
            else:
                element.attrib[name] = _text(min(max(number, -_NO_LIMIT), _NO_LIMIT) for number in numbers)
        colour = _numbers(element, "rgba", 4) if element.tag == "color" else None
        if colour and clipped_colour(colour) != tuple(colour):
            element.attrib["rgba"] = _text(clipped_colour(colour))


def _is_plain(word: str) -> bool:
    return _PLAIN.fullmatch(word) is not None and math.isfinite(float(word))


def _numbers(element: Element, name: str, count: int) -> list[float] | None:
    """Return numbers as the URDF reader reads them; None if there are none."""
    if name not in element.attrib:
        return None
    read = urdf_file.Element(element.tag, element.attrib, Place(0, "", 0), "")
    reader = Numbers(Problems())
    if element.tag == "mesh" and len(element.attrib[name].split()) == 1:
        factor = reader.read(read, name, 1)
        return factor * count if factor else None
    return reader.read(read, name, count, may_be_infinite=element.tag == "limit")


def _text(numbers: Iterable[float]) -> str:
    return " ".join(map(repr, map(float, numbers)))


def _mend_materials(root: Element) -> None:
    """Drop materials of the whole robot that are repeated, or that have neither colour nor texture."""
    names: set[str] = set()
    for material in root.findall("material"):
        _mend_numbers(material)
        name, color = material.get("name", ""), material.find("color")
        has_look = (color is not None and "rgba" in color.attrib) or material.find("texture") is not None
        if not name or name in names or not has_look:
            root.remove(material)
        names.add(name)


def _mend_inertial(element: Element, link: Link | None) -> None:
    """Complete an inertia by that of the robot as read; urdfdom drops a link whose inertia is incomplete."""
    written = element.find("inertial")
    if written is None or link is None or link.inertial is None:
        return
    inertia = written.find("inertia")
    if inertia is None:
        inertia = SubElement(written, "inertia")
    if any(name not in inertia.attrib for name in _INERTIA):
        inertia.attrib.update(zip(_INERTIA, map(repr, map(float, link.inertial.inertia)), strict=True))
    _mend_origin(written)


def _mend_shapes(link: Element, finder: MeshFinder) -> None:
    """Drop what is no shape to the reader, and replace what urdfdom does not know."""
    for place, owner in reversed(list(enumerate(link))):
        if owner.tag not in ("visual", "collision"):
            continue
        geometry = owner.find("geometry")
        form = next((child for child in geometry if child.tag in _FORMS), None) if geometry is not None else None
        if geometry is None or form is None or not _is_usable(form):
            link.remove(owner)
            continue
        geometry[:] = [form]
        _mend_origin(owner)
        if (material := owner.find("material")) is not None and not material.get("name"):
            color = material.find("color")
            material.attrib["name"] = "rgba " + (color.get("rgba", "") if color is not None else "")
        if form.tag == "mesh":
            form.attrib["filename"] = _found(form.attrib["filename"].strip(), finder)
        elif form.tag == "capsule":
            _replace_capsule(link, place, owner, form)


def _is_usable(form: Element) -> bool:
    """Return whether a shape has all its lengths, above 0."""
    counts = _COUNTS[form.tag]
    if form.tag == "mesh":
        return bool(form.get("filename", "").strip())
    return all(length > 0 for name, count in counts.items() for length in _numbers(form, name, count) or [0.0])


def _found(reference: str, finder: MeshFinder) -> str:
    """Return the absolute URI of a mesh file that exists on this machine, else the reference itself."""
    found = finder.locate(reference)
    is_ros = reference.startswith("package://") and FileReference.read(reference).package is not None
    if found is None or (is_ros and any((folder / "package.xml").is_file() for folder in found.parents)):
        return reference
    return found.resolve().as_uri()


def _replace_capsule(link: Element, place: int, owner: Element, form: Element) -> None:
    """Replace a shape with a capsule, which urdfdom lacks, by three shapes: a cylinder between two spheres."""
    link.remove(owner)
    for number, part in enumerate(_parts_of_capsule(owner, form)):
        link.insert(place + number, part)


def _parts_of_capsule(owner: Element, form: Element) -> list[Element]:
    radius, length = (float(form.attrib[name]) for name in ("radius", "length"))
    middle = _pose(owner)
    parts = []
    for tag, lengths, z in (
        ("cylinder", {"radius": radius, "length": length}, 0.0),
        ("sphere", {"radius": radius}, length / 2),
        ("sphere", {"radius": radius}, -length / 2),
    ):
        part = Element(owner.tag)
        pose = middle @ Pose((0.0, 0.0, z))
        SubElement(part, "origin", xyz=_text(pose.position), rpy=_text(rpy_of(pose)))
        SubElement(SubElement(part, "geometry"), tag, {name: repr(value) for name, value in lengths.items()})
        part.extend(owner.findall("material"))
        parts.append(part)
    return parts


def _mend_joint(joint: Element) -> None:
    """Complete the limits of a joint, and drop what is incomplete to urdfdom."""
    if joint.get("type") == JointType.SPHERICAL:
        # the nearest type that urdfdom knows
        joint.attrib["type"] = JointType.FLOATING.value
    for limit in joint.findall("limit"):
        for name in ("effort", "velocity"):
            # as in the reader: unknown, and no limit
            limit.attrib.setdefault(name, "0")
    required = {"dynamics": ("damping", "friction"), "safety_controller": ("k_velocity",)}
    for tag, names in required.items():
        for element in joint.findall(tag):
            if not any(name in element.attrib for name in names):
                joint.remove(element)
    _mend_origin(joint)


def _mend_origin(owner: Element) -> None:
    """Write an orientation as roll, pitch and yaw."""
    origin = owner.find("origin")
    if origin is not None and "quat_xyzw" in origin.attrib:
        pose = _pose(owner)
        origin.attrib.pop("quat_xyzw")
        origin.attrib["rpy"] = _text(rpy_of(pose))


def _pose(owner: Element) -> Pose:
    """Return the pose of an element, as the URDF reader reads it."""
    place = Place(0, "", 0)
    origins = [urdf_file.Element("origin", each.attrib, place, "") for each in owner.findall("origin")]
    return Numbers(Problems()).pose(urdf_file.Element(owner.tag, {}, place, "", origins))
