"""Arrays from outside: only plain numbers of exactly the bytes that type and shape say."""

import numpy as np
import pytest

from cellwright.clients.policies.array_forms import FORMS, LEBEDOV, NPY, OPENPI, ArrayForm, checked_array
from cellwright.util.errors import MessageError

F4 = bytes(4)


@pytest.mark.parametrize(
    ("dtype", "shape", "data", "problem"),
    [
        ("|O", [1], bytes(8), "an array's type must be bool, integer or float (got '|O')"),
        ("<U2", [1], bytes(8), "an array's type must be"),
        ("|V4", [1], F4, "an array's type must be"),
        ("<c8", [1], bytes(8), "an array's type must be"),
        ("<M8[s]", [1], bytes(8), "an array's type must be"),
        ("<f4,<f4", [1], bytes(8), "an array's type must be"),
        ("<f3", [1], bytes(3), "an array's type must be"),
        ("<f4\n", [1], F4, "an array's type must be"),
        ([["a", "<f4"]], [1], F4, "an array's type must be"),
        (None, [1], F4, "an array's type must be"),
        ("<f4", [-1], F4, "an array's shape must be a list of sizes (got [-1])"),
        ("<f4", [True], F4, "an array's shape must be"),
        ("<f4", [1.0], F4, "an array's shape must be"),
        ("<f4", 1, F4, "an array's shape must be"),
        ("<f4", [0, 2**40], b"", "an array's shape must be"),
        ("<f4", [1] * 6, F4, "an array has at most 5 axes (got 6)"),
        ("<f4", [1], bytes(5), "an array <f4 of shape [1] has 4 bytes (got 5)"),
        ("<f4", [2], F4, "an array <f4 of shape [2] has 8 bytes (got 4)"),
        ("<f4", [2**26, 2**26], F4, "an array <f4 of shape [67108864, 67108864] has"),
        ("<f4", [1], "0000", "an array's data must be bytes (got str)"),
        ("|b1", [2], b"\x01\x02", "a bool is 0 or 1 (got another byte)"),
    ],
)
def test_what_is_no_plain_array_is_refused(dtype: object, shape: object, data: object, problem: str) -> None:
    with pytest.raises(MessageError) as caught:
        checked_array(dtype, shape, data, "actions")
    assert str(caught.value).startswith(f"actions: {problem}")


def test_both_byte_orders_have_the_same_values() -> None:
    little = checked_array("<f4", [1], bytes.fromhex("0000803f"), "a")
    big = checked_array(">f4", [1], bytes.fromhex("3f800000"), "a")
    assert little[0] == big[0] == 1.0


@pytest.mark.parametrize(
    ("form", "fields", "problem"),
    [
        (OPENPI, {b"__ndarray__": True}, "an array's map has exactly the keys __ndarray__, data, dtype, shape"),
        (
            OPENPI,
            {b"__ndarray__": False, b"data": F4, b"dtype": "<f4", b"shape": [1]},
            "the mark of an array must be true",
        ),
        (
            OPENPI,
            {b"__ndarray__": True, b"data": F4, b"dtype": "<f4", b"shape": [1], b"x": 0},
            "an array's map has exactly",
        ),
        (OPENPI, {b"__npgeneric__": True, b"data": F4, b"dtype": "|O"}, "a scalar must be a plain number"),
        (OPENPI, {b"__npgeneric__": True, b"data": 300, b"dtype": "|u1"}, "the value does not fit |u1 (got 300)"),
        (OPENPI, {b"__npgeneric__": True, b"data": 1, b"dtype": "|b1"}, "the value of a scalar |b1 is of another type"),
        (OPENPI, {b"__npgeneric__": True, b"data": 1.5, b"dtype": "<i4"}, "the value of a scalar <i4 is of another"),
        (OPENPI, {b"__npgeneric__": 1, b"data": 1.5, b"dtype": "<f4"}, "the mark of an array must be true"),
        (LEBEDOV, {b"nd": True}, "an array's map has exactly the keys data, kind, nd, shape, type"),
        (LEBEDOV, {b"nd": None, b"type": "<f4", b"kind": b"", b"shape": [1], b"data": F4}, "the mark of an array must"),
        (LEBEDOV, {b"nd": True, b"type": "<f4", b"kind": b"O", b"shape": [1], b"data": F4}, "only arrays of plain"),
        (LEBEDOV, {b"nd": False, b"type": "|O", b"data": bytes(8)}, "an array's type must be"),
    ],
)
def test_what_is_no_marked_map_is_refused(form: ArrayForm, fields: dict[object, object], problem: str) -> None:
    with pytest.raises(MessageError) as caught:
        form.read(fields, "actions")
    assert str(caught.value).startswith(f"actions: {problem}")


def npy(header: str, data: bytes = F4, version: bytes = b"\x01\x00") -> bytes:
    return b"\x93NUMPY" + version + len(header).to_bytes(2, "little") + header.encode() + data


@pytest.mark.parametrize(
    ("content", "problem"),
    [
        ("text", "an array must be the bytes of a .npy file (got str)"),
        (b"", "not a .npy file of numpy"),
        (npy("{}", version=b"\x09\x00"), "not a .npy file of numpy"),
        (npy("{}")[:9], "not a .npy file of numpy"),
        (b"\x93NUMPY\x02\x00\xff\xff\xff\xff", "not a .npy file of numpy"),
        (npy("__import__('os')"), "a .npy file whose header cannot be read"),
        (npy("{'descr': '<f4'}"), "a .npy file whose header cannot be read"),
        (npy("(" * 5000), "a .npy file whose header cannot be read"),
        (npy("{'descr': '|O', 'fortran_order': False, 'shape': (1,)}", bytes(8)), "an array's type must be"),
        (npy("{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (1,)}"), "an array's type must be"),
        (npy("{'descr': '<f4', 'fortran_order': False, 'shape': (99999999,)}"), "an array's shape must be"),
        (npy("{'descr': '<f4', 'fortran_order': False, 'shape': (9999999,)}"), "an array <f4 of shape [9999999] has"),
        (npy("{'descr': '<f4', 'fortran_order': False, 'shape': 1}"), "an array's shape must be a tuple"),
    ],
    ids=range(13),
)
def test_what_is_no_npy_file_of_numbers_is_refused(content: object, problem: str) -> None:
    with pytest.raises(MessageError) as caught:
        NPY.read({"__ndarray_class__": True, "as_npy": content}, "actions")
    assert str(caught.value).startswith(f"actions: {problem}")


def test_marks_of_the_forms_differ() -> None:
    marks = [mark for form in FORMS for mark in form.marks]
    assert len(marks) == len(set(marks))


def test_npy_in_columns_has_its_shape() -> None:
    written = NPY.write(np.asfortranarray(np.arange(6.0).reshape(2, 3)))
    assert isinstance(written, dict)
    assert b"'fortran_order': True" in written["as_npy"]
    read = NPY.read(written, "a")
    assert isinstance(read, np.ndarray)
    assert read.tolist() == [[0, 1, 2], [3, 4, 5]]
