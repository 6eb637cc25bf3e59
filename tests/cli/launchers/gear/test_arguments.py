"""Tests of the command line of 2017's launcher."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cellwright.cli.launchers.gear.launcher import OUTPUT, parse, without_remappings


def parsed(arguments: list[str]) -> tuple[object, ...]:
    found = parse(arguments, {})
    return found.config, found.file, found.dry_run, found.verbose, found.output, found.competition


def test_empty_command_line_is_competition_without_configuration() -> None:
    assert parsed([]) == ("", [], False, False, Path("/tmp/ariac"), True)
    assert Path("/tmp/ariac") == OUTPUT


@pytest.mark.parametrize("development", ["-d", "--development-mode"])
@pytest.mark.parametrize("file", ["-f", "--file"])
def test_options_are_parsed(development: str, file: str) -> None:
    given = [development, file, "a.yaml", "b.yaml", "-n", "--verbose", "-o", "/there", "--no-gui"]
    assert parsed(given) == ("", ["a.yaml", "b.yaml"], True, True, Path("/there"), False)


def test_repeated_file_options_are_joined() -> None:
    assert parse(["-f", "a.yaml", "-f", "b.yaml"], {}).file == ["a.yaml", "b.yaml"]


def test_configuration_as_text_is_accepted() -> None:
    assert parse(["arm: {type: ur10}", "-d"], {}).config == "arm: {type: ur10}"


def test_competition_variable_forces_competition() -> None:
    assert parse(["-d"], {"ARIAC_COMPETITION": ""}).competition
    assert not parse(["-d"], {"ARIAC": "1"}).competition


def test_remappings_of_launch_file_are_dropped() -> None:
    given = ["-f", "a.yaml", "__name:=ariac_node", "__log:=/tmp/a.log", "/a:=/b", "_rate:=3"]
    assert parse(given, {}).file == ["a.yaml"]


@pytest.mark.slow
@given(st.lists(st.text(max_size=8)))
def test_only_remappings_are_dropped(arguments: list[str]) -> None:
    kept = without_remappings(arguments)
    assert kept == [each for each in arguments if ":=" not in each]
    assert without_remappings([*arguments, "a:=b"]) == kept


@pytest.mark.parametrize("wrong", [["a: 1", "-f", "a.yaml"], ["--competition"], ["a", "b"], ["-f"]])
def test_invalid_command_line_exits_with_usage(wrong: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as ended:
        parse(wrong, {})
    assert ended.value.code == 2
    assert "gear.py: error: " in capsys.readouterr().err
