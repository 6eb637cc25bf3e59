"""Messages of policy servers as bytes: MessagePack and JSON, with arrays in the form of the wire."""

import json
from collections.abc import Mapping

import msgspec
import numpy as np

from cellwright.clients.policies.array_forms import FORMS, JSON_NUMPY, MAX_BYTES, ArrayForm, sendable
from cellwright.util.errors import MessageError, one_printable_line

MAX_VALUES = 200_000
"""Most values of a message; an array has nine. In memory a value takes up to 64 times its bytes. A chunk of 1000
actions of 50 numbers, written as lists, has a fourth of them."""

_TYPED_KEYS = "an array whose marks are text: no server of this wire writes it"
# MessagePack's first bytes, by its specification of 2017: widths [bytes] of values, of lengths, and of counts
_FIXED = {0xC0: 0, 0xC2: 0, 0xC3: 0, 0xCA: 4, 0xCB: 8}
_FIXED |= {0xCC: 1, 0xCD: 2, 0xCE: 4, 0xCF: 8, 0xD0: 1, 0xD1: 2, 0xD2: 4, 0xD3: 8}  # integers
_SIZED = {0xC4: 1, 0xC5: 2, 0xC6: 4, 0xD9: 1, 0xDA: 2, 0xDB: 4}
_LISTS, _MAPS = {0xDC: 2, 0xDD: 4}, {0xDE: 2, 0xDF: 4}


def pack(value: object, form: ArrayForm) -> bytes:
    """Return a value as MessagePack.

    Args:
        value: mappings with text as keys, sequences, arrays and scalars of numpy, text, bytes, numbers, None.
        form: form of arrays on the wire.

    Raises:
        MessageError: something in it cannot be sent; the error begins with its key.

    Example:
        >>> from cellwright.clients.policies.array_forms import OPENPI
        >>> pack({"endpoint": "reset"}, OPENPI).hex()
        '81a8656e64706f696e74a57265736574'
    """
    try:
        return msgspec.msgpack.encode(_plain(value, form, ""))
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise MessageError(f"a message cannot be packed: {one_printable_line(str(error)[:200])}") from None


def unpack(data: bytes, form: ArrayForm) -> object:
    """Return MessagePack of a server as a value; keys are text, arrays are read-only.

    Raises:
        MessageError: it is none, too large, or has an array that cannot be read; the error begins with its key.
    """
    _check_counts(data)
    try:
        return _decoded(msgspec.msgpack.decode(data), form, "")
    except (msgspec.MsgspecError, ValueError, TypeError, RecursionError) as error:
        raise MessageError(f"not MessagePack ({one_printable_line(str(error)[:200])})") from None


def pack_json(value: object) -> bytes:
    """Return a value as JSON, with arrays in the form of json_numpy; errors as of `pack`."""
    try:
        return json.dumps(_plain(value, JSON_NUMPY, ""), allow_nan=False).encode()
    except (TypeError, ValueError, OverflowError, RecursionError) as error:
        raise MessageError(f"a message cannot be written as JSON: {one_printable_line(str(error)[:200])}") from None


def unpack_json(data: bytes) -> object:
    """Return JSON of a server as a value; arrays of json_numpy are read-only.

    Raises:
        MessageError: it is none, too large, or has an array that cannot be read.
    """
    if sum(data.count(sign) for sign in (b",", b"[", b"{")) > MAX_VALUES:
        raise MessageError(f"a message has at most {MAX_VALUES} values")
    try:
        return _decoded(json.loads(data), JSON_NUMPY, "")
    except (ValueError, RecursionError) as error:
        raise MessageError(f"not JSON ({one_printable_line(str(error)[:200])})") from None


def _plain(value: object, form: ArrayForm, place: str) -> object:
    """Return a value with its arrays as marked maps."""
    if isinstance(value, np.ndarray):
        return form.write(sendable(value, place))
    if isinstance(value, float):  # also numpy's float64, which the reference packs as the float that it is
        return float(value)
    if isinstance(value, str):
        return str(value)
    if isinstance(value, np.generic):
        sendable(np.asarray(value), place)
        return form.write_scalar(value)
    if value is None or isinstance(value, (bool, int, bytes)):
        return value
    if isinstance(value, Mapping):
        for key in value:
            if not isinstance(key, str):
                raise MessageError(f"{place or 'the message'}: a key must be text (got {_key(key)!r})")
        return {str(key): _plain(each, form, _below(place, key)) for key, each in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(each, form, f"{place}[{number}]") for number, each in enumerate(value)]
    raise MessageError(f"{place or 'the message'}: a value of this type cannot be sent (got {type(value).__name__})")


def _decoded(value: object, form: ArrayForm, place: str) -> object:
    """Return a decoded value with its marked maps as arrays, and keys of bytes as text."""
    if isinstance(value, list):
        return [_decoded(each, form, f"{place}[{number}]") for number, each in enumerate(value)]
    if not isinstance(value, dict):
        return value
    for other in FORMS:
        if any(mark in value for mark in other.marks):
            if other is form:
                return form.read(value, place or "the message")
            raise MessageError(
                f"{place or 'the message'}: an array in the form of {other.name} (expected {form.name}); set the "
                "dialect of the server"
            )
    if "__ndarray__" in value:
        raise MessageError(f"{place or 'the message'}: {_TYPED_KEYS}")
    for key in value:
        if not isinstance(key, (str, bytes)):
            raise MessageError(f"{place or 'the message'}: a key must be text (got {_key(key)!r})")
    return {_text(key): _decoded(each, form, _below(place, key)) for key, each in value.items()}


def _check_counts(data: bytes) -> None:
    """Refuse MessagePack with too many values or extension types, before any value is made.

    Raises:
        MessageError: it has.
    """
    if len(data) > MAX_BYTES:
        raise MessageError(f"a message has at most {MAX_BYTES} bytes (got {len(data)})")
    at, left, seen, end = 0, 1, 0, len(data)
    while left and at < end:
        head = data[at]
        left, seen, at = left - 1, seen + 1, at + 1
        if seen > MAX_VALUES:
            raise MessageError(f"a message has at most {MAX_VALUES} values")
        if head < 0x80 or head >= 0xE0:
            continue
        if head < 0xC0:
            at, left = (at + (head & 31), left) if head >= 0xA0 else (at, left + (head & 15) * (2 - (head >> 4 & 1)))
        elif head in _FIXED:
            at += _FIXED[head]
        elif (width := _SIZED.get(head)) is not None:
            at += width + int.from_bytes(data[at : at + width])
        elif (width := _LISTS.get(head, _MAPS.get(head))) is not None:
            left += int.from_bytes(data[at : at + width]) * (2 if head in _MAPS else 1)
            at += width
        else:
            raise MessageError(f"byte {at - 1}: no value of this wire, such as an extension type (got 0x{head:02x})")


def _below(place: str, key: object) -> str:
    return f"{place}/{_key(key)}" if place else _key(key)


def _key(key: object) -> str:
    """Return a key as one short line for errors."""
    text = _text(key)
    return one_printable_line(text[:80]) if len(text) > 80 or not text.isprintable() else text


def _text(key: object) -> str:
    return key.decode(errors="replace") if isinstance(key, bytes) else str(key)
