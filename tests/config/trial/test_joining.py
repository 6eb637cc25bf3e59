"""Names of files that are joined."""

import os
from pathlib import Path

import pytest

import cellwright
from cellwright.config.parsing.sources import Sources
from cellwright.config.trial.joining import find_files, joined_name, refuse_several_trials, split_names
from cellwright.running.run.target import Recordable
from cellwright.util.errors import UnknownNameError, UsageError

ORDERS = "orders: {order_0: {announcement_condition: time, announcement_condition_value: 0, parts: {}}}\n"


def test_names_are_joined_by_plus_lists_and_arguments_alike() -> None:
    wanted = cellwright.load_trial("final01", "kitter_sensors")
    assert cellwright.load_trial("final01+kitter_sensors") == wanted
    assert cellwright.load_trial(["final01+kitter_sensors"]) == wanted
    assert cellwright.load_trial(["final01", "kitter_sensors"]) == wanted


def test_session_of_joined_names_has_the_arm_and_names_the_files() -> None:
    for target in ("final01+kitter_sensors", ["final01", "kitter_sensors"]):
        with cellwright.Session(target) as session:
            assert session.node.trial.has_arm
            assert isinstance(session.target, Recordable)
            assert [file.stem for file in session.target.origin(Sources()).files] == ["final01", "kitter_sensors"]


def test_plus_in_the_path_of_a_file_joins_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    os.mkdir("c++")
    Path("c++", "a+b.yaml").touch()
    names = ["c++/a+b.yaml", "kitter_sensors", "c++/a+b.yaml"]
    assert split_names(joined_name(names)) == names
    assert find_files(Path("c++/a+b.yaml")) == [Path("c++/a+b.yaml")]


@pytest.mark.parametrize("text", ["+", "final01+", "+final01", "final01++kitter_sensors"])
def test_missing_name_beside_plus_is_refused(text: str) -> None:
    with pytest.raises(UsageError, match="a name is missing beside"):
        find_files(text)


def test_unknown_name_among_joined_ones_is_the_one_reported() -> None:
    with pytest.raises(UnknownNameError, match="'kitter_sensor'; did you mean kitter_sensors"):
        find_files("final01+kitter_sensor")


def test_two_files_with_orders_are_one_trial_or_two_and_refused(tmp_path: Path) -> None:
    one, other, more = tmp_path / "one.yaml", tmp_path / "other.yaml", tmp_path / "more.yaml"
    one.write_text(ORDERS)
    other.write_text(ORDERS)
    more.write_text("time_limit: 60\n")
    refuse_several_trials(["one", "more"], [[one], [more]])
    refuse_several_trials(["one+other", "more"], [[one, other], [more]])
    with pytest.raises(UsageError, match=r"one and other: both have orders.*write one\+more\+other for one"):
        refuse_several_trials(["one", "more", "other"], [[one], [more], [other]])
