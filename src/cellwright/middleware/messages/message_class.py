"""Base class and decorator of Cellwright's message classes, for the generated modules beside this one."""

import dataclasses
from collections.abc import Callable
from typing import Any, ClassVar, TypeVar, dataclass_transform


class MessageClass:
    """Base class of the messages, requests and responses that Cellwright defines."""

    __slots__ = ()
    __msgtype__: ClassVar[str]
    __dataclass_fields__: ClassVar[dict[str, dataclasses.Field[Any]]]


C = TypeVar("C", bound=MessageClass)


@dataclass_transform(field_specifiers=(dataclasses.field,))
def message_class(name: str) -> Callable[[type[C]], type[C]]:
    """Turn a class into the dataclass of a type with a full name ("osrf_gear/msg/Order")."""

    def decorate(cls: type[C]) -> type[C]:
        cls.__msgtype__ = name
        return dataclasses.dataclass(slots=True)(cls)

    return decorate
