"""Builders of orders, parts and trays for tests, and hypothesis strategies for them."""

from __future__ import annotations

import math
from itertools import product

from hypothesis import strategies as st

from cellwright.cell.kitting.inventory import TrayContents, TrayObject
from cellwright.config.trial.trial import Kit, KitObject, Order
from cellwright.util.pose import Pose

TYPES = ("gear_part", "disk_part", "piston_rod_part")
TRAY_1 = "agv1::kit_tray_1::kit_tray_1::tray"
TRAY_2 = "agv2::kit_tray_2::kit_tray_2::tray"


def pose(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, *, roll: float = 0.0, z: float = 0.0) -> Pose:
    return Pose.from_rpy((x, y, z), (roll, 0.0, yaw))


def ordered(type_: str = "gear_part", x: float = 0.0, y: float = 0.0, yaw: float = 0.0) -> KitObject:
    return KitObject(type_, pose(x, y, yaw))


def kit(*objects: KitObject, kit_type: str = "order_0_kit_0") -> Kit:
    return Kit(kit_type, objects)


def tray_object(
    type_: str = "gear_part", x: float = 0.0, y: float = 0.0, yaw: float = 0.0, *, name: str = "", faulty: bool = False
) -> TrayObject:
    return TrayObject(name or f"bin5|{type_}_1", type_, faulty, pose(x, y, yaw))


def order(
    number: int = 0,
    types: tuple[str, ...] = ("gear_part",),
    *,
    kits: int = 1,
    start_time: float | None = None,
    wanted_parts: int | None = None,
    unwanted_parts: int | None = None,
) -> Order:
    """Return an order whose parts lie in a row along x, 0.1 m apart, the first at the tray's origin."""
    objects = tuple(ordered(type_, 0.1 * place) for place, type_ in enumerate(types))
    name = f"order_{number}"
    return Order(
        name,
        tuple(Kit(f"{name}_kit_{index}", objects) for index in range(kits)),
        start_time=start_time,
        wanted_parts=wanted_parts,
        unwanted_parts=unwanted_parts,
    )


def full_tray(order_: Order, number: int = 0) -> TrayContents:
    """Return a tray that fills a kit of an order perfectly."""
    return tuple(
        TrayObject(f"bin5|{each.type}_{index}", each.type, False, each.pose)
        for index, each in enumerate(order_.kits[number].objects, start=1)
    )


# Places and yaws lie on a coarse grid around the tolerances, so that fits, near misses and ties are all common.
# All poses of the grid are made once: a pose is then one choice instead of four.
_PLACES = (-0.1, 0.0, 0.02, 0.029, 0.031, 0.1)
_YAWS = (0.0, 0.09, 0.11, 0.6, math.pi - 0.05, -math.pi + 0.04)
_ROLLS = (0.0, 0.0, 0.0, math.pi, 0.5, 0.7)
poses = st.sampled_from([pose(x, y, yaw, roll=roll) for x, y, yaw, roll in product(_PLACES, _PLACES, _YAWS, _ROLLS)])
kit_objects = st.builds(KitObject, st.sampled_from(TYPES), poses)
kits = st.builds(Kit, st.just("order_0_kit_0"), st.lists(kit_objects, max_size=5).map(tuple))

_KINDS = st.sampled_from(tuple(product((*TYPES, "pulley_part"), (False, False, False, True))))


@st.composite
def contents(draw: st.DrawFn, max_size: int = 7) -> TrayContents:
    """Draw objects on a tray, of the types in kits and of one type in no kit."""
    tray_objects = []
    for number in range(draw(st.integers(0, max_size))):
        type_, faulty = draw(_KINDS)
        tray_objects.append(TrayObject(f"bin5|part_{number}", type_, faulty, draw(poses)))
    return tuple(tray_objects)
