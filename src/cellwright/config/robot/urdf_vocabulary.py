"""Words of URDF: a warning for each attribute, element or text that the reader would otherwise drop in silence."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from cellwright.config.parsing.tree import Problems, shortened
from cellwright.config.robot.urdf_file import Element
from cellwright.util.errors import did_you_mean, suggestion

_FORMS = ("box", "sphere", "cylinder", "capsule", "mesh")
_FOREIGN = ("gazebo", "sensor", "verbose")
_MAX_WORD_LENGTH = 60
_MAX_FINDINGS = 500
_WORDS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "robot": {"attributes": ("name", "version"), "several": ("link", "joint", "material")},
    "link": {
        "attributes": ("name",),
        "single": ("inertial",),
        "several": ("visual", "collision"),
        "ignored": (*_FOREIGN, "contact", "self_collision_checking", "type"),
    },
    "joint": {
        "attributes": ("name", "type"),
        "single": ("origin", "parent", "child", "axis", "limit", "mimic"),
        "ignored": (*_FOREIGN, "dynamics", "joint_properties", "safety_controller", "calibration"),
    },
    "inertial": {"single": ("origin", "mass", "inertia")},
    "visual": {"attributes": ("name",), "single": ("origin", "geometry", "material"), "ignored": _FOREIGN},
    "collision": {
        "attributes": ("name",),
        "single": ("origin", "geometry"),
        "ignored": (*_FOREIGN, "material", "group", "concave", "contact_coefficients"),
    },
    "geometry": {"single": _FORMS},
    "material": {"attributes": ("name",), "single": ("color",), "ignored": ("texture", "script", "specular")},
    "origin": {"attributes": ("xyz", "rpy", "quat_xyzw")},
    "parent": {"attributes": ("link",)},
    "child": {"attributes": ("link",)},
    "axis": {"attributes": ("xyz",)},
    "limit": {"attributes": ("lower", "upper", "effort", "velocity")},
    "mimic": {"attributes": ("joint", "multiplier", "offset")},
    "mass": {"attributes": ("value",)},
    "inertia": {"attributes": ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")},
    "box": {"attributes": ("size",)},
    "sphere": {"attributes": ("radius",)},
    "cylinder": {"attributes": ("radius", "length")},
    "capsule": {"attributes": ("radius", "length")},
    "mesh": {"attributes": ("filename", "scale")},
    "color": {"attributes": ("rgba",)},
}
"""Words by element, as fields of `_Words`."""
_INNER = tuple(tag for tag in _WORDS if tag not in ("robot", *_WORDS["robot"]["several"]))


def warn_of_ignored(robot: Element, problems: Problems) -> None:
    """Warn of what is ignored in a robot's file, once for each kind, with the place of the first one.

    Names with a colon, such as `drake:joint`, belong to other programs, and mean nothing here.
    """
    found: dict[str, list[Element]] = {}
    for element, message in _findings(robot):
        if message in found or len(found) < _MAX_FINDINGS:
            found.setdefault(message, []).append(element)
    for message, elements in found.items():
        count = f" ({len(elements)} times)" if len(elements) > 1 else ""
        problems.warn(elements[0], message + count)


@dataclass(frozen=True, slots=True)
class _Words:
    """Words inside an element: its attributes, and its children.

    Attributes:
        attributes: those that are read.
        single: children of which one is read, the first.
        several: children of which all are read.
        ignored: attributes and children of URDF, or of programs that read it, that mean nothing here.
    """

    attributes: tuple[str, ...] = ()
    single: tuple[str, ...] = ()
    several: tuple[str, ...] = ()
    ignored: tuple[str, ...] = ()

    @property
    def children(self) -> tuple[str, ...]:
        return (*self.single, *self.several)


def _findings(robot: Element) -> Iterator[tuple[Element, str]]:
    ahead = [robot]
    while ahead:
        element = ahead.pop()
        words = _Words(**_WORDS[element.tag])
        yield from _attributes(element, words)
        yield from _text(element, words)
        seen: set[str] = set()
        inner = []
        for child in element.children:
            if child.tag in words.children:
                kind = "shape" if element.tag == "geometry" else child.tag
                if child.tag in words.single and kind in seen:
                    yield child, f"more than one {kind} in <{element.tag}>; the first is used, this one is ignored"
                else:
                    inner.append(child)
                seen.add(kind)
            elif hint := _hint(child, element, words):
                yield child, f"unknown element <{shortened(child.tag)}>, ignored{hint}"
        ahead.extend(reversed(inner))


def _attributes(element: Element, words: _Words) -> Iterator[tuple[Element, str]]:
    for name in element.attributes:
        if name not in (*words.attributes, *words.ignored) and ":" not in name and name != "xmlns":
            known = suggestion(name[:_MAX_WORD_LENGTH], words.attributes)
            yield element, f"unknown attribute {shortened(name)!r} of <{element.tag}>, ignored{known}"


def _text(element: Element, words: _Words) -> Iterator[tuple[Element, str]]:
    """Yield a finding about a text where URDF has attributes, such as `<axis>0 0 1</axis>`."""
    text = " ".join("".join(element.texts).split())
    if text:
        remedy = (
            f"; write attributes ({', '.join(words.attributes)})" if words.attributes and not words.children else ""
        )
        yield element, f"the text {shortened(text)!r} in <{element.tag}> is ignored{remedy}"


def _hint(child: Element, parent: Element, words: _Words) -> str:
    """Return what to say of an unknown element; empty if it belongs to another program."""
    if ":" in child.tag or child.tag in (*words.ignored, *_FOREIGN):
        return ""
    if child.tag in words.attributes:
        return f"; write it as an attribute of <{parent.tag}>"
    hint = did_you_mean(child.tag[:_MAX_WORD_LENGTH], words.children)
    # other programs have whole sections here
    if parent.tag == "robot":
        return hint or (f"; it must be inside of <{_owner(child.tag)}>" if child.tag in _INNER else "")
    # the reader of shapes reports it
    if parent.tag == "geometry":
        return ""
    return hint or (f"; it must be inside of <{_owner(child.tag)}>" if child.tag in _WORDS else f" in <{parent.tag}>")


def _owner(tag: str) -> str:
    """Return the first element that has such a child."""
    return next((owner for owner, words in _WORDS.items() if tag in _Words(**words).children), "robot")
