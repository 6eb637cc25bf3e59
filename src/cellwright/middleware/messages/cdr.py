"""CDR of ROS 2, written by functions that are generated for each type.

The library also writes any type, field by field, with a call for each number; tests compare with it, and it reads
messages. Every message costs a recording and each socket client the time to write it. So consecutive numbers are one
call here, and strings, which are nearly always known names, come from a cache.
"""

import struct
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray
from rosbags.interfaces import Nodetype
from rosbags.interfaces.typing import Constdefs, Fielddefs, FieldDesc
from rosbags.typesys.base import normalize_fieldname

from cellwright.middleware.messages.message_class import Message

MAX_CACHED_STRINGS = 1024
MAX_CACHED_BYTES = 1024
"""Limits of the string cache [number, bytes of each]: strings come from outside, and must not fill the memory."""
_MAX_ALIGNMENT = 8  # bytes of the largest alignment of a number
HEAD = 4
"""Bytes of the encapsulation header; offsets in a message count from its end."""
LITTLE_ENDIAN = 256
"""The encapsulation header of little-endian CDR, as a number."""
_CODES = {
    "bool": "?", "byte": "b", "char": "B", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q", "float32": "f", "float64": "d",
}  # fmt: skip


Definitions: TypeAlias = Mapping[str, tuple[Constdefs, Fielddefs]]
"""Constants and fields of types, by full name."""
Writer: TypeAlias = Callable[[Message], bytes]


def cdr_writer(name: str, definitions: Definitions) -> Writer:
    """Return a new writer of a type, by full name: little-endian CDR with its four-byte head.

    It does not validate, and raises Python's own errors for values that do not fit.
    """
    return _WriterSource(name, definitions).compiled()


def number_size(name: str) -> int:
    """Return the bytes of a number by its type in definitions, such as "float64"."""
    return struct.calcsize(f"<{_CODES[name]}")


def number_format(name: str) -> str:
    """Return numpy's little-endian type of such a number."""
    return f"<{np.dtype(_CODES[name]).str[1:]}"


class _WriterSource:
    """Source of one writer, generated field by field.

    Consecutive numbers wait, to be packed together. Their padding follows from the offset in the message, which is
    known here as `_place` modulo `_modulus`: 8 at the beginning, and 1 behind a string.
    """

    def __init__(self, name: str, definitions: Definitions) -> None:
        self._name, self._definitions = name, definitions
        self._lines: list[str] = []
        self._indent = " "
        self._structs: dict[str, Callable[..., bytes]] = {}
        self._format, self._values = "<I", [str(LITTLE_ENDIAN)]
        self._has_begun = False
        self._place, self._modulus = 0, _MAX_ALIGNMENT
        self._variables = 0
        self._message(name, "message", 1)
        if self._has_begun:
            self._flush()
            self._add("return bytes(data)")
        else:
            self._add(f"return {self._packed()}")

    def compiled(self) -> Writer:
        """Return the compiled writer."""
        source = "\n".join(["def write(message):", *self._lines])
        names = {**_names(), **self._structs}
        exec(compile(source, f"<CDR of {self._name}>", "exec"), names)  # noqa: S102, made of definitions alone
        write: Writer = names["write"]
        return write

    def _message(self, name: str, value: str, follows: int) -> None:
        """Add the fields of a message in a variable; `follows` is the alignment of what comes behind it."""
        fields = self._definitions[name][1]
        needs = [*(self._alignment(desc) for _, desc in fields[1:]), follows]
        for (field, desc), need in zip(fields, needs, strict=True):
            self._field(f"{value}.{normalize_fieldname(field)}", desc, need)

    def _field(self, value: str, desc: FieldDesc, follows: int) -> None:
        match desc:
            case (Nodetype.BASE, ("string", _)):
                self._cached("text", value, follows)
            case (Nodetype.BASE, (name, _)):
                self._number(_CODES[str(name)], value)
            case (Nodetype.NAME, name):
                self._message(str(name), value if value.isidentifier() else self._variable(value), follows)
            case (Nodetype.SEQUENCE, ((Nodetype.BASE, ("string", _)), _)):
                self._cached("texts", f"tuple({value})", follows)
            case (kind, ((Nodetype.BASE, (name, _)), length)) if name != "string":
                self._numbers(str(name), value, int(length) if kind == Nodetype.ARRAY else None)
            case (kind, (member, length)):
                self._each(value, member, int(length) if kind == Nodetype.ARRAY else None, follows)

    def _number(self, code: str, value: str) -> None:
        size = struct.calcsize(f"<{code}")
        self._align(size)
        self._format += code
        self._values.append(value)
        self._place = (self._place + size) % self._modulus

    def _cached(self, kind: str, value: str, follows: int) -> None:
        """Add a string or a sequence of strings, looked up in the cache as a whole."""
        self._align(4)
        self._flush()
        # The padding behind a string is kept with it in the cache: then the offset is known again, modulo four.
        is_filled = follows >= 4
        self._add(f"data += {kind}{'_filled' if is_filled else ''}[{value}]")
        self._place, self._modulus = 0, 4 if is_filled else 1

    def _numbers(self, name: str, value: str, length: int | None) -> None:
        # An array of another byte order or size would be written without an error: its type is looked at first.
        size = struct.calcsize(f"<{_CODES[name]}")
        values, count = self._variable(value), self._variable(None)
        self._add(f"({count},) = {values}.shape")
        self._add(f"if {values}.dtype is not dtype_{name}: {values} = little({values}, dtype_{name})")
        if length is None:
            self._number("I", count)
            self._flush()
            self._add(f"if {count}:")
            self._indent += " "
        else:
            self._require(count, length)
        before = self._place, self._modulus
        self._align(size)
        self._flush()
        self._add(f"data += {values}.tobytes()")
        if length is None:
            self._indent = self._indent[:-1]
            self._place, self._modulus = _common(before, (0, size))
        else:
            self._place = (self._place + length * size) % self._modulus

    def _each(self, value: str, member: FieldDesc, length: int | None, follows: int) -> None:
        """Add messages, or a fixed number of strings."""
        values, each = self._variable(value), self._variable(None)
        if length is None:
            self._number("I", f"len({values})")
        else:
            self._require(f"len({values})", length)
        self._flush()
        self._add(f"for {each} in {values}:")
        before = self._place, self._modulus
        lines, variables = len(self._lines), self._variables
        self._indent += " "
        # A round begins where the one before ended, so only the part of the offset that both share is known at its
        # beginning. It shrinks from 8 to 4, 2 and 1 at most: the fourth attempt holds.
        while True:
            begun = self._place, self._modulus
            self._field(each, member, min(follows, self._alignment(member)))
            self._flush()
            ended = self._place, self._modulus
            if _common(begun, ended) == begun:
                break
            del self._lines[lines:]
            self._variables = variables
            self._place, self._modulus = _common(begun, ended)
        self._indent = self._indent[:-1]
        self._place, self._modulus = _common(before, ended)

    def _align(self, size: int) -> None:
        """Add zeros up to the next multiple of a size."""
        if self._modulus >= size:
            zeros = -self._place % size
            self._format += f"{zeros}x" if zeros else ""
            self._place = (self._place + zeros) % self._modulus
        else:
            self._flush()
            self._add(f"data += fill_{size}[len(data) % {size}]")
            self._place, self._modulus = 0, size

    def _flush(self) -> None:
        """Pack the numbers that wait."""
        if self._format != "<":
            self._add(f"data += {self._packed()}" if self._has_begun else f"data = bytearray({self._packed()})")
            self._has_begun = True

    def _packed(self) -> str:
        name = f"pack_{self._format[1:]}".replace("?", "o")
        self._structs[name] = struct.Struct(self._format).pack
        call = f"{name}({', '.join(self._values)})"
        self._format, self._values = "<", []
        return call

    def _require(self, count: str, length: int) -> None:
        self._add(f"if {count} != {length}: raise ValueError('must have {length} entries')")

    def _alignment(self, desc: FieldDesc) -> int:
        """Return the alignment of a field's first byte."""
        match desc:
            case (Nodetype.BASE, (name, _)):
                return 4 if name == "string" else struct.calcsize(f"<{_CODES[str(name)]}")
            case (Nodetype.NAME, name):
                return self._alignment(self._definitions[str(name)][1][0][1])
            case (Nodetype.ARRAY, (member, _)):
                return self._alignment(member)
        return 4

    def _variable(self, value: str | None) -> str:
        """Return a new variable; with a value, assign it."""
        self._variables += 1
        name = f"v{self._variables}"
        if value is not None:
            self._add(f"{name} = {value}")
        return name

    def _add(self, line: str) -> None:
        self._lines.append(self._indent + line)


def _common(one: tuple[int, int], other: tuple[int, int]) -> tuple[int, int]:
    """Return what two offsets (offset, modulus) have in common."""
    # Offsets agree modulo the largest power of two that divides their difference.
    modulus = min(one[1], other[1])
    while (one[0] - other[0]) % modulus:
        modulus //= 2
    return one[0] % modulus, modulus


class StringCache(dict[Any, bytes]):
    """Cache of encoded strings, by value; a missing one is encoded at lookup.

    With `filled`, zeros pad each to the next multiple of four bytes.
    """

    def __init__(self, write: Callable[[Any], bytes], *, filled: bool) -> None:
        super().__init__()
        self._write, self._filled = write, filled

    def __missing__(self, key: Any) -> bytes:
        data = self._write(key)
        if self._filled:
            data += bytes(-len(data) % 4)
        if len(data) <= MAX_CACHED_BYTES:
            if len(self) >= MAX_CACHED_STRINGS:
                self.clear()
            self[key] = data
        return data


def cdr_string(value: str) -> bytes:
    """Return an encoded string: its length, its bytes and a zero."""
    data = value.encode()
    return struct.pack(f"<I{len(data)}sx", len(data) + 1, data)


def cdr_strings(values: tuple[str, ...]) -> bytes:
    """Return encoded strings: their number, then each at the next multiple of four bytes."""
    written = bytearray(struct.pack("<I", len(values)))
    for value in values:
        written += bytes(-len(written) % 4)
        written += cdr_string(value)
    return bytes(written)


def _little(values: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    """Return an array with its bytes in little-endian order; a ValueError if it is not of the field's type."""
    if values.dtype.newbyteorder("<") != dtype:
        raise ValueError(f"an array of {values.dtype}, not of {dtype}")
    return values.astype(dtype)


@cache
def _names() -> dict[str, Any]:
    """Return the names that generated writers use."""
    return {
        "text": StringCache(cdr_string, filled=False),
        "text_filled": StringCache(cdr_string, filled=True),
        "texts": StringCache(cdr_strings, filled=False),
        "texts_filled": StringCache(cdr_strings, filled=True),
        "little": _little,
        **{f"fill_{size}": [bytes((HEAD - place) % size) for place in range(size)] for size in (2, 4, 8)},
        **{f"dtype_{name}": np.dtype(number_format(name)) for name in _CODES},
    }
