import json
from math import cos, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cell.devices.vacuum_gripper import CHECK_PERIOD, ContactKind, CupContact, VacuumCheck
from cellwright.engine.clock import NEVER

STEP = 2_000_000
PISTON = CupContact("bin7|piston_rod_part_3", ContactKind.PART, 1.0)
BIN = CupContact("bin7", ContactKind.FIXED, 1.0)
TRAY = CupContact("agv1", ContactKind.MOVABLE, 1.0)
LOOKS = [(), (PISTON,), (BIN,), (TRAY,), (BIN, PISTON), (CupContact("x", ContactKind.PART, 0.5),)]


def enabled(at: int = 0) -> VacuumCheck:
    check = VacuumCheck()
    check.enable(at)
    return check


def run_check(check: VacuumCheck, *contacts: CupContact) -> str | None:
    """Return the held part after the check."""
    check.check(check.next_look, contacts)
    return check.part


def test_part_is_gripped_at_second_check() -> None:
    check = enabled(0)
    assert check.next_look == 0
    assert run_check(check, PISTON) is None
    assert check.reason == "waiting for a second check"
    assert check.next_look == CHECK_PERIOD
    assert run_check(check, PISTON) == PISTON.name
    assert (check.part, check.attached, check.reason) == (PISTON.name, True, "")


@pytest.mark.parametrize(
    ("contacts", "reason"),
    [
        ((), "no contact"),
        ((BIN,), "contact with something fixed: bin7"),
        ((TRAY,), "contact with agv1, which is no part"),
        ((CupContact("p", ContactKind.PART, cos(radians(23))),), "tilted: 23.0 deg > 18.2"),
        ((CupContact("p", ContactKind.PART, 0.95),), "tilted: 18.2 deg > 18.2"),
        ((CupContact("p", ContactKind.PART, -1.0000001),), "tilted: 180.0 deg > 18.2"),
    ],
)
def test_contact_that_is_not_gripped_has_reason(contacts: tuple[CupContact, ...], reason: str) -> None:
    check = enabled()
    for _ in range(4):
        assert run_check(check, *contacts) is None
    assert check.reason == reason


def test_disabled_gripper_grips_nothing_with_reason() -> None:
    check = VacuumCheck()
    assert (check.reason, check.next_look) == ("disabled", NEVER)
    check.enable(0)
    assert check.disable() is None
    assert (check.reason, check.lost_reason, check.next_look) == ("disabled", "", NEVER)


def test_contact_with_tray_counts_towards_grip() -> None:
    check = enabled()
    run_check(check, TRAY)
    assert run_check(check, PISTON) == PISTON.name


def test_checks_without_contact_count_down_to_zero() -> None:
    check = enabled()
    run_check(check, PISTON)
    run_check(check)
    run_check(check, BIN)
    assert check.counter == 0
    assert run_check(check, PISTON) is None
    assert run_check(check, PISTON) == PISTON.name


def test_best_aligned_part_is_gripped_then_first_name() -> None:
    check = enabled()
    tilted = CupContact("a", ContactKind.PART, 0.96)
    equal = CupContact("bin7|piston_rod_part_2", ContactKind.PART, 1.0)
    run_check(check, tilted)
    assert run_check(check, tilted, PISTON, equal) == equal.name


def test_rounding_error_does_not_choose_between_two_parts() -> None:
    check = enabled()
    equal = CupContact("bin7|piston_rod_part_2", ContactKind.PART, 1.0 + 8e-14)
    longer = CupContact(PISTON.name, ContactKind.PART, 1.0 + 7e-13)
    run_check(check, longer, equal)
    assert run_check(check, longer, equal) == equal.name


def test_released_part_is_gripped_again_at_next_check() -> None:
    check = enabled()
    for _ in range(3):
        run_check(check, PISTON)
    last = 2 * CHECK_PERIOD
    assert check.disable() == PISTON.name
    assert (check.lost_reason, check.reason, check.part) == ("released", "disabled", None)
    check.enable(last + STEP)
    assert check.next_look == last + CHECK_PERIOD
    check.disable()
    check.enable(last + 5 * CHECK_PERIOD + STEP)
    assert check.next_look == last + 5 * CHECK_PERIOD + STEP
    assert run_check(check, PISTON) == PISTON.name


def test_second_enable_has_no_effect() -> None:
    check = enabled(0)
    run_check(check, PISTON)
    before = check.get_state()
    check.enable(STEP)
    assert check.get_state() == before


def test_forced_drop_happens_at_check_and_keeps_gripper_enabled() -> None:
    check = enabled()
    run_check(check, PISTON)
    run_check(check, PISTON)
    check.check(2 * CHECK_PERIOD, [PISTON])
    assert check.attached
    check.check(3 * CHECK_PERIOD, [PISTON], is_dropped=True)
    assert (check.enabled, check.part, check.reason, check.lost_reason) == (True, None, "forced drop", "forced drop")
    check.check(4 * CHECK_PERIOD, [PISTON], is_dropped=True)  # nothing is held that could be dropped
    assert check.part == PISTON.name


def test_lost_part_has_given_reason() -> None:
    check = enabled()
    assert check.lose("pulled off") is None
    assert check.lost_reason == ""
    run_check(check, PISTON)
    run_check(check, PISTON)
    assert check.lose("pulled off") == PISTON.name
    assert check.lost_reason == check.reason == "pulled off"


@pytest.mark.parametrize("phase", [0, 30_000_000, 99_999_999, 130_000_000])
def test_checks_with_phase_keep_to_their_clock(phase: int) -> None:
    check = VacuumCheck(phase)
    check.enable(1_234_000_000)
    looks = []
    for _ in range(3):
        looks.append(check.next_look)
        run_check(check, PISTON)
    assert looks[0] - 1_234_000_000 < CHECK_PERIOD
    assert [time % CHECK_PERIOD for time in looks] == [phase % CHECK_PERIOD] * 3
    assert looks[2] - looks[0] == 2 * CHECK_PERIOD


@given(st.lists(st.tuples(st.integers(0, 80), st.sampled_from(["enable", "disable", *LOOKS])), max_size=60))
def test_checks_are_at_least_period_apart_in_any_story(story: list[tuple[int, str | tuple[CupContact, ...]]]) -> None:
    check, now, last = VacuumCheck(), 0, -CHECK_PERIOD
    for steps, event in story:
        now += steps * STEP
        if event == "enable":
            check.enable(now)
        elif event == "disable":
            held = check.part
            assert check.disable() == held
        elif now >= check.next_look and not isinstance(event, str):
            assert now - last >= CHECK_PERIOD
            last = now
            counter, held = check.counter, check.part
            check.check(now, event)
            assert abs(check.counter - counter) <= 1
            if check.part != held:
                assert held is None
                assert check.counter > 1
                assert any(contact.name == check.part and contact.alignment > 0.95 for contact in event)
        assert check.attached == (check.part is not None)
        assert check.enabled or not check.attached
        assert bool(check.reason) != check.attached
        other = VacuumCheck()
        other.set_state(json.loads(json.dumps(check.get_state())))
        assert vars(other) == vars(check)
