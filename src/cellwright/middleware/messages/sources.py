"""The definition files that the project brings: what the library's store lacks.

They are written so that ROS 1 and ROS 2 can both take them (but for `time` and `duration`, which ROS 2 spells
otherwise), and lie in the folder `definitions` as `<package>/msg/<Name>.msg` and `<package>/srv/<Name>.srv`.
"""

from collections.abc import Iterator
from functools import cache
from importlib.resources import files

from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Constdefs, Fielddefs
from rosbags.typesys import get_types_from_msg

from cellwright.middleware.messages.names import MESSAGE, SERVICE, full_name
from cellwright.util.errors import UnknownNameError

EMPTY: Fielddefs = [("structure_needs_at_least_one_member", (Nodetype.BASE, ("uint8", 0)))]
"""Fields of a message without any, as ROS 2 has it; ROS 1 sends nothing."""


@cache
def sources() -> dict[str, str]:
    """The text of every definition file, by full name ("osrf_gear/msg/Order", "std_srvs/srv/Trigger"), sorted."""
    found = {}
    for package in (files("cellwright.middleware.messages") / "definitions").iterdir():
        for namespace in package.iterdir():
            for file in namespace.iterdir():
                stem, _, ending = file.name.rpartition(".")
                if ending == namespace.name:
                    found[f"{package.name}/{namespace.name}/{stem}"] = file.read_text(encoding="utf-8")
    return dict(sorted(found.items()))


def source(name: str) -> str:
    """The text of one definition file, message or service.

    Raises:
        UnknownNameError: the project brings no file of this name.
    """
    texts = sources()
    for namespace in (MESSAGE, SERVICE):
        if (text := texts.get(full_name(name, namespace))) is not None:
            return text
    raise UnknownNameError("definition file", name, texts)


def parsed() -> Iterator[tuple[str, tuple[Constdefs, Fielddefs]]]:
    """Every type that the files define, with its constants and fields; a service makes two types."""
    for name, text in sources().items():
        package, namespace, last = name.split("/")
        if namespace == MESSAGE:
            yield name, _parse(text, package, last)
        else:
            request, _, response = text.partition("---\n")
            yield f"{name}_Request", _parse(request, package, last)
            yield f"{name}_Response", _parse(response, package, last)


def _parse(text: str, package: str, last: str) -> tuple[Constdefs, Fielddefs]:
    name = f"{package}/msg/{last}"  # so that a bare type name is looked up in its own package
    constants, fields = get_types_from_msg(text, name)[name]
    return constants, fields or EMPTY
