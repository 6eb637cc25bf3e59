"""Agreement of several arms."""

from cellwright.clients.agents.kitter.agreement import Agreement
from cellwright.clients.agents.kitter.perception import Sighting
from tests.clients.agents.kitter.fakes import belt_part, flat


def test_kit_has_one_builder_and_arm_with_less_to_do_comes_first() -> None:
    agreement = Agreement([["tray1", "tray2"], ["tray3"]])
    one, other = agreement.share(0), agreement.share(1)
    anywhere = {"tray1", "tray2", "tray3"}
    assert one.take_kit("a", anywhere)
    assert not other.take_kit("a", anywhere)
    assert (one.has_kit("a"), other.has_kit("a"), other.has_kit("b")) == (True, False, True)
    assert not one.take_kit("b", anywhere), "the other arm has nothing to do"
    assert other.take_kit("b", anywhere)
    assert one.take_kit("c", anywhere), "the other arm has no second tray"
    one.end_kit("a")
    one.end_kit("c")
    assert not one.has_kit("b")


def test_kit_for_one_tray_is_for_the_arm_there() -> None:
    agreement = Agreement([["tray1"], ["tray3"]])
    one = agreement.share(0)
    assert one.take_kit("a", {"tray1"})
    assert one.take_kit("b", {"tray1"}), "it waits for its tray, as the other arm has none for it"


def test_first_arm_alone_reports_of_a_kit_that_none_has_begun() -> None:
    agreement = Agreement([["tray1"], ["tray3"]])
    one, other = agreement.share(0), agreement.share(1)
    other.take_kit("a", {"tray3"})
    assert [each.reports("a") for each in (one, other)] == [False, True]
    assert [each.reports("b") for each in (one, other)] == [True, False]


def test_part_is_taken_by_one_arm() -> None:
    agreement = Agreement([["tray1"], ["tray3"]])
    one, other = agreement.share(0), agreement.share(1)
    lying, seen = Sighting("gear_part", flat(0.1, 0.2)), Sighting("gear_part", flat(0.101, 0.2))
    one.take_part(lying)
    assert (one.is_free(lying), other.is_free(seen)) == (True, False)
    assert other.is_free(Sighting("gear_part", flat(0.2, 0.2)))
    assert other.is_free(Sighting("disk_part", flat(0.1, 0.2)))
    one.end_part(is_taken=False)
    assert other.is_free(seen)
    assert (other.has_news(), other.has_news(), one.has_news()) == (True, False, False)


def test_part_that_was_taken_off_a_belt_is_not_there_for_another_arm() -> None:
    agreement = Agreement([["tray1"], ["tray3"]])
    one, other = agreement.share(0), agreement.share(1)
    one.take_part(belt_part("gear_part", 10.0))
    one.end_part(is_taken=True)
    assert not other.is_free(belt_part("gear_part", 10.01))
    assert other.is_free(belt_part("gear_part", 18.0))
