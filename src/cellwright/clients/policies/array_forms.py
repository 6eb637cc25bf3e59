"""Arrays in messages of policy servers: four forms of marked maps, and the check of those that come in.

A server is untrusted. An array is taken only if its elements are plain numbers, and its bytes have exactly the length
that type and shape say. Public decoders make object arrays over foreign bytes, which can crash the process.
"""

import ast
import base64
import binascii
import io
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from math import prod
from typing import Any

import numpy as np
import numpy.typing as npt

from cellwright.util.errors import MessageError, one_printable_line

MAX_BYTES = 64 * 2**20
"""Largest message, and so the largest array, that a server may send [bytes]; vLLM-Omni takes as much. Four pictures of
1080 lines have 24 MiB."""

MAX_AXES = 5
"""Most axes of an array: a batch of films in colour has as many."""

Array = npt.NDArray[Any]

_DTYPE = re.compile(r"[<>|]?(?:b1|[iu][1248]|f[248])")
_KINDS = "biuf"
_MAX_NPY_HEADER = 10_000  # numpy's own limit


@dataclass(frozen=True)
class ArrayForm:
    """Notation of arrays on a wire: a map with a key that no other map has.

    Attributes:
        name: name of the form in errors.
        marks: keys of which a map of this form has one.
        write: a map of an array, in row-major order.
        write_scalar: a map, or a plain value, of a scalar of numpy.
        read: the array or scalar of a map, or a MessageError that begins with the given place.
    """

    name: str
    marks: tuple[object, ...]
    write: Callable[[Array], object]
    write_scalar: Callable[[np.generic], object]
    read: Callable[[Mapping[object, object], str], object]


def checked_array(dtype: object, shape: object, data: object, place: str) -> Array:
    """Return bytes from outside as an array, a read-only view of them.

    Args:
        dtype: type in numpy's notation, such as "<f4": bool, integer or float, of either byte order.
        shape: list of sizes, at most five.
        data: the elements in row-major order.
        place: key of the array, for errors.

    Raises:
        MessageError: any of them is something else, or they do not agree.

    Example:
        >>> checked_array("<f4", [3], bytes.fromhex("0000003f000080bf00000040"), "actions")
        array([ 0.5, -1. ,  2. ], dtype=float32)
        >>> checked_array("|O", [1], bytes(8), "actions")
        Traceback (most recent call last):
        cellwright.util.errors.MessageError: actions: an array's type must be bool, integer or float (got '|O')
    """
    if not isinstance(dtype, str) or not _DTYPE.fullmatch(dtype):
        raise MessageError(f"{place}: an array's type must be bool, integer or float (got {_short(dtype)})")
    if not isinstance(shape, list) or not all(type(each) is int and 0 <= each <= MAX_BYTES for each in shape):
        raise MessageError(f"{place}: an array's shape must be a list of sizes (got {_short(shape)})")
    if len(shape) > MAX_AXES:
        raise MessageError(f"{place}: an array has at most {MAX_AXES} axes (got {len(shape)})")
    if not isinstance(data, bytes):
        raise MessageError(f"{place}: an array's data must be bytes (got {type(data).__name__})")
    kind = np.dtype(dtype)
    expected = prod(shape) * kind.itemsize
    if len(data) != expected:
        raise MessageError(f"{place}: an array {dtype} of shape {shape} has {expected} bytes (got {len(data)})")
    if kind.kind == "b" and data.strip(b"\x00\x01"):
        raise MessageError(f"{place}: a bool is 0 or 1 (got another byte)")
    return np.frombuffer(data, kind).reshape(shape)


def sendable(array: Array, place: str) -> Array:
    """Return an array that every server can read.

    Raises:
        MessageError: its elements are no plain numbers, or it has too many axes.
    """
    if array.dtype.kind not in _KINDS or not _DTYPE.fullmatch(array.dtype.str):
        raise MessageError(f"{place}: only arrays of bool, integers and floats can be sent (got {array.dtype})")
    if array.ndim > MAX_AXES:
        raise MessageError(f"{place}: an array has at most {MAX_AXES} axes (got {array.ndim})")
    return array


def _short(value: object) -> str:
    return one_printable_line(repr(value)[:60])


def _has_keys(fields: Mapping[object, object], keys: set[object], place: str) -> None:
    if fields.keys() != keys:
        names = ", ".join(sorted(each.decode() if isinstance(each, bytes) else str(each) for each in keys))
        raise MessageError(f"{place}: an array's map has exactly the keys {names} (got {_short(list(fields))})")


def _marked(value: object, place: str) -> None:
    if value is not True:
        raise MessageError(f"{place}: the mark of an array must be true (got {_short(value)})")


def _write_openpi(array: Array) -> object:
    return {b"__ndarray__": True, b"data": array.tobytes(), b"dtype": array.dtype.str, b"shape": list(array.shape)}


def _write_openpi_scalar(scalar: np.generic) -> object:
    return {b"__npgeneric__": True, b"data": scalar.item(), b"dtype": scalar.dtype.str}


def _read_openpi(fields: Mapping[object, object], place: str) -> object:
    if b"__ndarray__" in fields:
        _has_keys(fields, {b"__ndarray__", b"data", b"dtype", b"shape"}, place)
        _marked(fields[b"__ndarray__"], place)
        return checked_array(fields[b"dtype"], fields[b"shape"], fields[b"data"], place)
    _has_keys(fields, {b"__npgeneric__", b"data", b"dtype"}, place)
    _marked(fields[b"__npgeneric__"], place)
    dtype, value = fields[b"dtype"], fields[b"data"]
    if not isinstance(dtype, str) or not _DTYPE.fullmatch(dtype) or not isinstance(value, (bool, int, float)):
        raise MessageError(f"{place}: a scalar must be a plain number (got {_short(dtype)}, {_short(value)})")
    kind = np.dtype(dtype)
    if (kind.kind == "b") is not isinstance(value, bool) or (kind.kind in "iu" and not isinstance(value, int)):
        raise MessageError(f"{place}: the value of a scalar {dtype} is of another type (got {_short(value)})")
    try:
        with np.errstate(over="ignore"):  # a float32 of 1e300 is infinite, as its sender's was
            return kind.type(value)
    except OverflowError:
        raise MessageError(f"{place}: the value does not fit {dtype} (got {_short(value)})") from None


def _write_lebedov(array: Array) -> object:
    return {b"nd": True, b"type": array.dtype.str, b"kind": b"", b"shape": list(array.shape), b"data": array.tobytes()}


def _write_lebedov_scalar(scalar: np.generic) -> object:
    return {b"nd": False, b"type": scalar.dtype.str, b"data": scalar.tobytes()}


def _read_lebedov(fields: Mapping[object, object], place: str) -> object:
    if fields[b"nd"] is False:
        _has_keys(fields, {b"nd", b"type", b"data"}, place)
        return checked_array(fields[b"type"], [], fields[b"data"], place)[()]
    _has_keys(fields, {b"nd", b"type", b"kind", b"shape", b"data"}, place)
    _marked(fields[b"nd"], place)
    if fields[b"kind"] != b"":
        raise MessageError(f"{place}: only arrays of plain numbers are read (got kind {_short(fields[b'kind'])})")
    return checked_array(fields[b"type"], fields[b"shape"], fields[b"data"], place)


def _write_npy(array: Array) -> object:
    content = io.BytesIO()
    np.save(content, array, allow_pickle=False)
    return {"__ndarray_class__": True, "as_npy": content.getvalue()}


def _read_npy(fields: Mapping[object, object], place: str) -> object:
    _has_keys(fields, {"__ndarray_class__", "as_npy"}, place)
    _marked(fields["__ndarray_class__"], place)
    content = fields["as_npy"]
    if not isinstance(content, bytes):
        raise MessageError(f"{place}: an array must be the bytes of a .npy file (got {type(content).__name__})")
    dtype, columns_first, shape, start = _npy_header(content, place)
    array = checked_array(dtype, shape[::-1] if columns_first else shape, content[start:], place)
    return array.T if columns_first else array


def _npy_header(content: bytes, place: str) -> tuple[object, bool, list[object], int]:
    """Return type, whether columns come first, shape, and the start of the elements: numpy's formats 1.0 to 3.0.

    numpy's own reader reserves memory for any shape before it looks at the length of the content.
    """
    width = {b"\x93NUMPY\x01\x00": 2, b"\x93NUMPY\x02\x00": 4, b"\x93NUMPY\x03\x00": 4}.get(content[:8])
    start = 8 + (width or 0)
    end = start + int.from_bytes(content[8:start], "little")
    if width is None or end > min(len(content), _MAX_NPY_HEADER):
        raise MessageError(f"{place}: not a .npy file of numpy")
    try:
        header = ast.literal_eval(content[start:end].decode("utf-8").strip())
    except (ValueError, TypeError, SyntaxError, MemoryError, RecursionError):
        header = None
    if not isinstance(header, dict) or header.keys() != {"descr", "fortran_order", "shape"}:
        raise MessageError(f"{place}: a .npy file whose header cannot be read (got {_short(content[start:end])})")
    shape = header["shape"]
    if not isinstance(shape, tuple):
        raise MessageError(f"{place}: an array's shape must be a tuple of sizes (got {_short(shape)})")
    return header["descr"], bool(header["fortran_order"]), list(shape), end


def _write_json(array: Array) -> object:
    return {
        "__numpy__": base64.b64encode(array.tobytes()).decode(),
        "dtype": array.dtype.str,
        "shape": list(array.shape),
    }


def _read_json(fields: Mapping[object, object], place: str) -> object:
    _has_keys(fields, {"__numpy__", "dtype", "shape"}, place)
    text = fields["__numpy__"]
    try:
        data = base64.b64decode(text, validate=True) if isinstance(text, str) else None
    except (binascii.Error, ValueError):
        data = None
    if data is None:
        raise MessageError(f"{place}: an array's elements must be base64 (got {_short(text)})")
    array = checked_array(fields["dtype"], fields["shape"], data, place)
    return array[()] if array.ndim == 0 else array


OPENPI = ArrayForm("openpi", (b"__ndarray__", b"__npgeneric__"), _write_openpi, _write_openpi_scalar, _read_openpi)
"""Form of OpenPI's own packer (openpi@15a9616)."""

LEBEDOV = ArrayForm("lebedov", (b"nd",), _write_lebedov, _write_lebedov_scalar, _read_lebedov)
"""Form of the package msgpack-numpy 0.4.8, of Lev Givon and lebedov: MolmoSpaces and XPolicyLab."""

NPY = ArrayForm("groot", ("__ndarray_class__",), _write_npy, lambda scalar: scalar.item(), _read_npy)
"""Form of GR00T's servers (Isaac-GR00T@38624df): the bytes of a .npy file."""

JSON_NUMPY = ArrayForm(
    "json_numpy", ("__numpy__",), _write_json, lambda scalar: _write_json(np.asarray(scalar)), _read_json
)
"""Form of json-numpy 2.1.1, for JSON: OpenVLA's servers and their kin."""

FORMS = (OPENPI, LEBEDOV, NPY, JSON_NUMPY)
"""All forms."""
