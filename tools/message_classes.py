"""Message classes of the definition files: `python -m tools.message_classes` writes their modules.

Each package of `middleware/messages/definitions` becomes a module of that name beside the folder, with one class for
each message, request and response. The first comment of a definition is the docstring of its class; the comments of its
fields become comments in the class. Every field has a default value.
"""

import re
import textwrap
from pathlib import Path

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import FieldDesc
from rosbags.typesys.base import normalize_fieldname

from cellwright.middleware.messages import TYPES, short_name

FOLDER = Path(__file__).parents[1] / "src" / "cellwright" / "middleware" / "messages"

_PACKAGE = "cellwright.middleware.messages"
_WIDTH = 120
_FLOAT = ("float", "0.0")
_BASE_TYPES = {"bool": ("bool", "False"), "string": ("str", '""'), "float32": _FLOAT, "float64": _FLOAT}
_ARRAYS = {"float64": ("Floats", "floats"), "uint64": ("Counts", "counts")}
_FACTORIES = {
    "actionlib_msgs/msg/GoalID": "goal_id",
    "actionlib_msgs/msg/GoalStatus": "goal_status",
    "builtin_interfaces/msg/Duration": "duration",
    "builtin_interfaces/msg/Time": "stamp",
    "geometry_msgs/msg/Pose": "origin",
    "sensor_msgs/msg/JointState": "joint_state",
    "std_msgs/msg/Header": "header",
    "trajectory_msgs/msg/JointTrajectory": "joint_trajectory",
    "trajectory_msgs/msg/JointTrajectoryPoint": "trajectory_point",
}
"""Functions of `messages.conversions` that make the default value of a shared type."""
_DEFAULTS = {("cellwright_msgs/msg/TeleopStatus", "enabled"): "True"}
"""Default values that do not follow from the type of the field."""

_LINE = re.compile(r"\S+\s+(?P<name>\w+)\s*(=\s*[^#]*)?(#\s*(?P<comment>.*))?")


def modules() -> dict[str, str]:
    """Return the source of each module, by package."""
    packages = sorted({name.partition("/")[0] for name, _ in TYPES.parsed()})
    return {package: _Module(package).source() for package in packages}


def main() -> None:
    """Write the modules."""
    for package, source in modules().items():
        (FOLDER / f"{package}.py").write_text(source, encoding="utf-8")


class _Module:
    """Module of one package."""

    def __init__(self, package: str) -> None:
        self._package = package
        self._definitions = {name: item for name, item in TYPES.parsed() if name.startswith(f"{package}/")}
        self._imports: set[str] = set()
        self._has_factories = self._has_constants = False
        self._classes: dict[str, list[str]] = {}

    def source(self) -> str:
        """Return the text of the module."""
        for name in self._definitions:
            self._add_class(name)
        lines = [
            f'"""Messages and services of {self._package}, made of `definitions/{self._package}`.',
            "",
            "Generated: change the definitions, and run `python -m tools.message_classes`.",
            '"""',
            "",
            *(["from dataclasses import field"] if self._has_factories else []),
            *(["from typing import ClassVar"] if self._has_constants else []),
            *([""] if self._has_factories or self._has_constants else []),
            *([f"from {_PACKAGE} import {', '.join(sorted(self._imports))}"] if self._imports else []),
            f"from {_PACKAGE}.message_class import MessageClass, message_class",
        ]
        for each in self._classes.values():
            lines += ["", "", *each]
        return "\n".join([*lines, ""])

    def _add_class(self, name: str) -> None:
        """Add the class of a type, after those of the types in it."""
        if name in self._classes:
            return
        constants, fields = self._definitions[name]
        annotated = [(normalize_fieldname(field), self._type_and_default(desc)) for field, desc in fields]
        about, comments = _comments(name)
        lines = [f'@message_class("{name}")', f"class {_class_name(name)}(MessageClass):", f'    """{about}"""', ""]
        for field, (annotation, default) in annotated:
            default = _DEFAULTS.get((name, field), default)
            lines += _commented(f"    {field}: {annotation} = {default}", comments.get(field, ""))
        lines += [f"    {constant}: ClassVar[int] = {value}" for constant, _, value in constants]
        self._has_constants |= bool(constants)
        self._classes[name] = lines

    def _type_and_default(self, desc: FieldDesc) -> tuple[str, str]:
        """Return the annotation and the default value of a field."""
        match desc:
            case (Nodetype.BASE, (name, _)):
                return _BASE_TYPES.get(str(name), ("int", "0"))
            case (Nodetype.NAME, name) if name in self._definitions:
                return self._class(str(name)), self._made_by(self._class(str(name)))
            case (Nodetype.NAME, name):
                return self._class(str(name)), self._made_by(self._imported("conversions", _FACTORIES[str(name)]))
            case (Nodetype.SEQUENCE, ((Nodetype.BASE, ("string", _)), _)):
                return "list[str]", self._made_by("list")
            case (Nodetype.SEQUENCE, ((Nodetype.BASE, (name, _)), _)) if name in _ARRAYS:
                annotation, factory = (self._imported("conversions", each) for each in _ARRAYS[str(name)])
                return annotation, self._made_by(factory)
            case (Nodetype.SEQUENCE, ((Nodetype.NAME, name), _)):
                return f"list[{self._class(str(name))}]", self._made_by("list")
        raise NotImplementedError(f"no class has a field of this form yet: {desc}")

    def _class(self, name: str) -> str:
        """Return the name of a type's class, which is defined above or imported."""
        if name not in self._definitions:
            return self._imported("standard", _class_name(name))
        self._add_class(name)
        return _class_name(name)

    def _imported(self, module: str, name: str) -> str:
        self._imports.add(module)
        return f"{module}.{name}"

    def _made_by(self, factory: str) -> str:
        self._has_factories = True
        return f"field(default_factory={factory})"


def _class_name(name: str) -> str:
    return name.rpartition("/")[2].replace("_", "")


def _commented(line: str, comment: str) -> list[str]:
    """Return a line with its comment: behind it if there is room, else above it."""
    if not comment or len(line) + len(comment) + 4 <= _WIDTH:
        return [f"{line}  # {comment}" if comment else line]
    return [*(f"    # {each}" for each in textwrap.wrap(comment, _WIDTH - 6)), line]


def _comments(name: str) -> tuple[str, dict[str, str]]:
    """Return the comments of a definition: of the type as a whole, and of each field."""
    stem = re.sub("_(Request|Response)$", "", name)
    halves = TYPES.sources[stem].split("---\n")
    about, waiting, comments = f"Response of {short_name(stem)}.", "", {}
    for line in halves[name.endswith("_Response")].splitlines():
        if line.startswith("#"):
            waiting = f"{waiting} {line[1:].strip()}".strip()
        elif match := _LINE.fullmatch(line):
            comments[match["name"]] = match["comment"] or waiting
            waiting = ""
        elif waiting:
            about, waiting = waiting, ""
    return about, comments


if __name__ == "__main__":
    main()
