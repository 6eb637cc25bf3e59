"""Forms of rotations: each is the inverse of itself, and the published conventions hold."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.clients.policies.rotations import SIZES, numbers_of, rotation_of, rotation_vector
from cellwright.util.errors import UsageError
from cellwright.util.pose import Quaternion, normalized

FORMS = [form for form in SIZES if form != "none"]
HALF = math.sqrt(0.5)
ABOUT_Z = (HALF, 0.0, 0.0, HALF)
"""A quarter turn about z."""

components = st.floats(-1.0, 1.0).filter(lambda value: value == 0.0 or abs(value) > 1e-6)
rotations = st.tuples(components, components, components, components).filter(lambda q: math.hypot(*q) > 0.1)


def angle_between(a: Quaternion, b: Quaternion) -> float:
    return 2.0 * math.acos(min(1.0, abs(sum(p * q for p, q in zip(a, b, strict=True)))))


@given(rotation=rotations, form=st.sampled_from(FORMS))
def test_form_gives_its_rotation_back(rotation: Quaternion, form: str) -> None:
    unit = normalized(rotation)
    numbers = numbers_of(unit, form)
    assert len(numbers) == SIZES[form]
    assert angle_between(rotation_of(numbers, form), unit) < 1e-6


@pytest.mark.parametrize(
    ("form", "numbers"),
    [
        ("axis_angle", (0.0, 0.0, math.pi / 2)),
        ("quaternion_wxyz", (HALF, 0.0, 0.0, HALF)),
        ("quaternion_xyzw", (0.0, 0.0, HALF, HALF)),
        ("euler_xyz", (0.0, 0.0, math.pi / 2)),
        ("rot6d", (0.0, 1.0, 0.0, -1.0, 0.0, 0.0)),
    ],
)
def test_quarter_turn_about_z_in_each_form(form: str, numbers: tuple[float, ...]) -> None:
    assert numbers_of(ABOUT_Z, form) == pytest.approx(numbers, abs=1e-12)


def test_columns_are_made_right_angled() -> None:
    assert angle_between(rotation_of((0.0, 2.0, 0.0, -1.0, 1.0, 0.0), "rot6d"), ABOUT_Z) < 1e-9


def test_no_rotation_has_no_numbers() -> None:
    assert numbers_of(ABOUT_Z, "none") == ()
    assert rotation_of((), "none") == (1.0, 0.0, 0.0, 0.0)


def test_small_turn_keeps_its_size() -> None:
    assert rotation_vector(rotation_of((1e-12, 0.0, 0.0), "axis_angle")) == pytest.approx((1e-12, 0.0, 0.0), rel=1e-6)


@pytest.mark.parametrize(
    ("form", "numbers"),
    [
        ("quaternion_xyzw", (0.0, 0.0, 0.0, 0.0)),
        ("rot6d", (0.0, 0.0, 0.0, 1.0, 0.0, 0.0)),
        ("rot6d", (1.0, 0.0, 0.0, 2.0, 0.0, 0.0)),
    ],
)
def test_numbers_that_are_no_rotation_are_refused(form: str, numbers: tuple[float, ...]) -> None:
    with pytest.raises(UsageError, match=form):
        rotation_of(numbers, form)
