import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.kitting.inventory import TrayContents, TrayObject
from cellwright.cell.kitting.kit_score import (
    MAX_DISTANCE,
    MAX_YAW_DIFFERENCE,
    MIN_QUATERNION_DOT,
    BonusVerdict,
    ExtraObject,
    ExtraReason,
    Verdict,
    fit_of,
    score_kit,
    verdict_of,
)
from cellwright.config.trial.trial import Kit, KitObject
from cellwright.util.pose import Pose
from tests.cell.kitting.builders import contents, kit, kit_objects, kits, ordered, pose, tray_object


def object_at(place: Pose, type_: str = "gear_part") -> TrayObject:
    return TrayObject("bin5|gear_part_1", type_, False, place)


@pytest.mark.parametrize(
    ("place", "verdict"),
    [
        (pose(), Verdict.PLACED),
        (pose(0.0299), Verdict.PLACED),
        (pose(0.0301), Verdict.TOO_FAR),
        (pose(0.02, 0.02), Verdict.PLACED),
        (pose(0.022, 0.022), Verdict.TOO_FAR),
        (pose(z=5.0), Verdict.PLACED),
        (pose(yaw=0.0999), Verdict.PLACED),
        (pose(yaw=0.1001), Verdict.TURNED),
        (pose(yaw=-0.0999), Verdict.PLACED),
        (pose(yaw=0.63), Verdict.TURNED),
        (pose(yaw=0.64), Verdict.TILTED),
        (pose(yaw=math.pi), Verdict.TILTED),
        (pose(roll=0.63), Verdict.PLACED),
        (pose(roll=0.64), Verdict.TILTED),
        (pose(roll=math.pi), Verdict.TILTED),
    ],
)
def test_verdict_follows_tolerances(place: Pose, verdict: Verdict) -> None:
    assert verdict_of(fit_of(ordered(), object_at(place))) is verdict


def test_fit_has_distance_and_angles() -> None:
    fit = fit_of(ordered(x=0.1, y=0.2, yaw=math.pi - 0.02), object_at(pose(0.13, 0.24, 0.03 - math.pi, z=0.7)))
    assert fit.object_name == "bin5|gear_part_1"
    assert fit.distance == pytest.approx(0.05)
    assert fit.yaw_difference == pytest.approx(0.05)
    assert fit.quaternion_dot == pytest.approx(math.cos(0.025))


@pytest.mark.slow
@given(kit_objects, st.sampled_from((1.0, -1.0)), st.floats(0.9, 1.1))
def test_yaw_is_that_of_normalised_quaternion_of_either_sign(goal: KitObject, sign: float, length: float) -> None:
    w, x, y, z = goal.pose.quaternion
    scale = sign * length
    fit = fit_of(goal, object_at(Pose(goal.pose.position, (scale * w, scale * x, scale * y, scale * z))))
    assert fit.yaw_difference == pytest.approx(0.0, abs=1e-6)


def test_perfect_tray_earns_all_points() -> None:
    ordered_kit = kit(ordered(), ordered("disk_part", 0.1), ordered(x=0.2))
    score = score_kit(ordered_kit, (tray_object(x=0.2), tray_object("disk_part", 0.1), tray_object()))
    assert (score.part_presence, score.all_parts_bonus, score.part_pose) == (3.0, 3.0, 3.0)
    assert score.total == score.maximum == 9.0
    assert score.is_complete
    assert score.is_submitted
    assert score.bonus is BonusVerdict.EARNED
    assert score.extras == ()


def test_empty_tray_earns_nothing_and_empty_kit_is_complete() -> None:
    score = score_kit(kit(ordered()), ())
    assert score.total == 0.0
    assert not score.is_complete
    assert [part.verdict for part in score.parts] == [Verdict.MISSING]
    assert score.parts[0].fit is None
    nothing_asked = score_kit(kit(), ())
    assert nothing_asked.total == 0.0
    assert nothing_asked.is_complete


def test_extra_objects_are_listed_with_reason() -> None:
    tray = (
        tray_object("pulley_part", name="bin8|pulley_part_1"),
        tray_object(x=0.3, name="bin5|gear_part_7"),
        tray_object(name="bin5|gear_part_8"),
        tray_object(name="bin5|gear_part_9", faulty=True),
    )
    score = score_kit(kit(ordered()), tray)
    assert score.extras == (
        ExtraObject("bin8|pulley_part_1", "pulley_part", ExtraReason.WRONG_TYPE),
        ExtraObject("bin5|gear_part_7", "gear_part", ExtraReason.SURPLUS),
        ExtraObject("bin5|gear_part_9", "gear_part", ExtraReason.FAULTY),
    )
    assert score.bonus is BonusVerdict.EXTRA_OBJECTS
    assert score.total == 2.0
    assert score.is_complete


def test_faulty_part_in_place_is_named_and_earns_nothing() -> None:
    score = score_kit(kit(ordered(), ordered(x=0.2)), (tray_object(x=0.2, faulty=True, name="bin5|gear_part_3"),))
    assert [part.verdict for part in score.parts] == [Verdict.MISSING, Verdict.FAULTY]
    fit = score.parts[1].fit
    assert fit is not None
    assert fit.object_name == "bin5|gear_part_3"
    assert score.total == 0.0
    assert score.bonus is BonusVerdict.PARTS_SHORT


def test_objects_take_first_fitting_place_in_order_of_report() -> None:
    # Both places are near enough to the first object; the second object would have needed the one it took.
    ordered_kit = kit(ordered(x=0.0), ordered(x=0.04))
    near_both, near_first = tray_object(x=0.02, name="a"), tray_object(x=-0.01, name="b")
    taken = score_kit(ordered_kit, (near_both, near_first))
    assert taken.part_pose == 1.0
    assert [part.verdict for part in taken.parts] == [Verdict.PLACED, Verdict.TOO_FAR]
    fit = taken.parts[1].fit
    assert fit is not None
    assert fit.object_name == "b"
    assert fit.distance == pytest.approx(0.05)
    assert score_kit(ordered_kit, (near_first, near_both)).part_pose == 2.0


def test_misplaced_objects_match_closest_places() -> None:
    ordered_kit = kit(ordered(x=0.0), ordered(x=0.2))
    score = score_kit(ordered_kit, (tray_object(x=0.15, name="a"), tray_object(x=-0.05, name="b")))
    names = [part.fit.object_name for part in score.parts if part.fit is not None]
    assert names == ["b", "a"]
    assert score.part_presence == 2.0
    assert score.all_parts_bonus == 2.0


@pytest.mark.slow
@given(kits, contents())
def test_points_are_between_zero_and_three_per_part(ordered_kit: Kit, tray: TrayContents) -> None:
    score = score_kit(ordered_kit, tray)
    assert 0.0 <= score.total <= score.maximum == 3.0 * len(ordered_kit.objects)
    assert score.part_pose <= score.part_presence
    assert score.is_complete == (score.part_pose == len(ordered_kit.objects))


@pytest.mark.slow
@given(kits, contents())
def test_presence_and_bonus_equal_counts_of_rules(ordered_kit: Kit, tray: TrayContents) -> None:
    score = score_kit(ordered_kit, tray)
    types = {goal.type for goal in ordered_kit.objects}
    expected = {type_: sum(goal.type == type_ for goal in ordered_kit.objects) for type_ in types}
    present = {type_: sum(each.type == type_ and not each.is_faulty for each in tray) for type_ in types}
    assert score.part_presence == sum(min(expected[type_], present[type_]) for type_ in types)
    exact = len(tray) == len(ordered_kit.objects) and all(present[type_] >= expected[type_] for type_ in types)
    assert score.all_parts_bonus == (len(ordered_kit.objects) if exact else 0.0)


@pytest.mark.slow
@given(kits, contents())
def test_objects_are_accounted_for_once(ordered_kit: Kit, tray: TrayContents) -> None:
    score = score_kit(ordered_kit, tray)
    fits = {id(part): part.fit for part in score.parts if part.fit is not None}
    standing = [part.fit.object_name for part in score.parts if part.fit is not None and part.is_present]
    assert sorted([*standing, *(extra.name for extra in score.extras)]) == sorted(each.name for each in tray)
    assert len({fit.object_name for fit in fits.values()}) == len(fits)
    for part, goal in zip(score.parts, ordered_kit.objects, strict=True):
        assert (part.type, part.tray_T_goal) == (goal.type, goal.pose)
        assert (part.fit is None) == (part.verdict is Verdict.MISSING)
        if part.fit is not None and part.verdict is not Verdict.FAULTY:
            assert part.verdict is verdict_of(part.fit)


@pytest.mark.slow
@given(st.data(), kits, contents())
def test_order_of_report_changes_neither_presence_nor_bonus(
    data: st.DataObject, ordered_kit: Kit, tray: TrayContents
) -> None:
    score, shuffled = score_kit(ordered_kit, tray), score_kit(ordered_kit, tuple(data.draw(st.permutations(tray))))
    assert (shuffled.part_presence, shuffled.all_parts_bonus) == (score.part_presence, score.all_parts_bonus)


@pytest.mark.slow
@given(st.data(), kits)
def test_order_of_report_changes_nothing_for_distant_places(data: st.DataObject, ordered_kit: Kit) -> None:
    apart = Kit(
        ordered_kit.kit_type,
        tuple(
            KitObject(goal.type, Pose((0.5 * number, 0.0, 0.0), goal.pose.quaternion))
            for number, goal in enumerate(ordered_kit.objects)
        ),
    )
    tray = tuple(
        TrayObject(f"part_{number}", goal.type, False, goal.pose @ pose(data.draw(st.sampled_from((0.0, 0.02, 0.2)))))
        for number, goal in enumerate(apart.objects)
    )
    assert score_kit(apart, tuple(data.draw(st.permutations(tray)))).parts == score_kit(apart, tray).parts


@pytest.mark.slow
@given(st.data(), kits, contents())
def test_extra_object_adds_at_most_one_presence_and_one_pose(
    data: st.DataObject, ordered_kit: Kit, tray: TrayContents
) -> None:
    (more,) = data.draw(contents(max_size=7).filter(len).map(lambda tray_objects: tray_objects[:1]))
    before, after = score_kit(ordered_kit, tray), score_kit(ordered_kit, (*tray, more))
    assert 0.0 <= after.part_presence - before.part_presence <= 1.0
    assert 0.0 <= after.part_pose - before.part_pose <= 1.0
    if after.part_presence == before.part_presence:
        assert after.all_parts_bonus == 0.0 or not ordered_kit.objects


@given(kits, contents())
def test_unordered_objects_cost_only_bonus(ordered_kit: Kit, tray: TrayContents) -> None:
    before = score_kit(ordered_kit, tray)
    for more in (
        tray_object("pulley_part"),
        tray_object(ordered_kit.objects[0].type if ordered_kit.objects else "gear_part", faulty=True),
    ):
        after = score_kit(ordered_kit, (*tray, more))
        assert (after.part_presence, after.part_pose) == (before.part_presence, before.part_pose)
        assert after.all_parts_bonus == 0.0


def test_tolerances_are_those_of_competition() -> None:
    assert (MAX_DISTANCE, MIN_QUATERNION_DOT, MAX_YAW_DIFFERENCE) == (0.03, 0.95, 0.1)
