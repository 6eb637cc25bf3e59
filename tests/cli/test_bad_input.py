"""Tests of bad input: exit status 2, one line each on stderr, nothing on stdout, nothing started."""

from pathlib import Path

import pytest

from cellwright.config.trial.catalogue import all_bundled
from tests.cli.conftest import CommandLine

UNTIL = ("--agent", "none", "--until", "0.1", "--no-picture")


def refused(ran: object) -> str:
    """Return the only line of output, which holds the reason."""
    status, out, err = (getattr(ran, name) for name in ("status", "out", "err"))
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert err.count("\n") == 1
    return str(err).removeprefix("error: ").rstrip("\n")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("option", "value", "message"),
    [
        ("--speed", "0", "--speed 0: give a factor above 0, such as 1 for real time, or max"),
        ("--speed", "nan", "--speed nan: give a factor above 0, such as 1 for real time, or max"),
        ("--speed", "fast", "--speed fast: give a factor above 0, such as 1 for real time, or max"),
        ("--until", "nan", "--until nan: give a time above 0 s and up to 1e+09 s"),
        ("--until", "-1", "--until -1: give a time above 0 s and up to 1e+09 s"),
        ("--until", "inf", "--until inf: give a time above 0 s and up to 1e+09 s"),
        ("--min-score", "nan", "--min-score nan: give a number"),
        (
            "--servo",
            "orignal",
            "--servo: unknown servo profile 'orignal'; did you mean original (known: original, precise)",
        ),
        (
            "--camera",
            "bin",
            "--camera: unknown view 'bin'; did you mean bins (known: overview, bins, agv1, agv2, belt)",
        ),
        ("--snapshot", "1:cell.jpg", "--snapshot 1:cell.jpg: give a time in seconds and a file, such as 12.5:cell.png"),
        ("--snapshot", "cell.png", "--snapshot cell.png: give a time in seconds and a file, such as 12.5:cell.png"),
        ("--snapshot", "-1:a.png", "--snapshot -1:a.png: give a time in seconds and a file, such as 12.5:cell.png"),
        ("--snapshot", "1e-999999999:no/a.png", "--snapshot 1e-999999999:no/a.png: there is no folder no"),
        ("--snapshot", "1:folder.png", "--snapshot 1:folder.png: folder.png is a folder"),
        ("--checkpoint", "1:no/a.npz", "--checkpoint 1:no/a.npz: there is no folder no"),
        ("--agent", "no.py:Agent", "no.py: there is no such file"),
        ("--agent", "folder.py:Agent", "folder.py: there is no such file"),
        ("--agent", "lessn", "unknown agent 'lessn'; did you mean lesson (known: kitter, lesson, operator); "),
        ("--agent", "agents.py:Ende", "agents.py: unknown class 'Ende'; did you mean Ends"),
        ("--agent", "agents.py:NoAgent", "agents.py:NoAgent: an agent is a class with a method run(client)"),
        ("--agent", "agents.py:CannotBeMade", "agents.py:CannotBeMade: cannot be made: TypeError: "),
        (
            "--agent",
            "raises.py:Agent",
            "raises.py:2: cannot be imported: ModuleNotFoundError: No module named 'nowhere'",
        ),
        ("--agent", "wrong.py:Agent", "wrong.py:1: cannot be imported: SyntaxError: '(' was never closed"),
        ("--agent", "exits.py:Agent", "exits.py:1: cannot be imported: SystemExit: 3"),
        ("--agent", "nowhere:Agent", "nowhere: cannot be imported: ModuleNotFoundError: No module named 'nowhere'"),
        ("--agent", "none", "--agent none requires --until SECONDS: without an agent a run has no end"),
        ("--seed", "-1", "--seed -1: give a whole number from 0 to 2**63 - 1"),
        ("--seed", str(2**63), f"--seed {2**63}: give a whole number from 0 to 2**63 - 1"),
        ("--seed", "x", "Invalid value for '--seed'"),
        ("--bogus", "1", "No such option: --bogus (Possible options: --log, --verbose) (see cellwright run --help)"),
    ],
)
def test_run_with_invalid_option_is_refused(
    option: str, value: str, message: str, cellwright: CommandLine, agents: str, tmp_path: Path
) -> None:
    (tmp_path / "raises.py").write_text("import os\nimport nowhere\n")
    (tmp_path / "wrong.py").write_text("x = (\n")
    (tmp_path / "exits.py").write_text("raise SystemExit(3)\n")
    for folder in ("folder.png", "folder.py"):
        (tmp_path / folder).mkdir()
    assert refused(cellwright("run", "lesson", "--no-picture", option, value)).startswith(message)
    assert not (tmp_path / "lesson.png").exists()


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("no.yaml", "no.yaml: there is no such file"),
        ("broken.yml", "broken.yml: there is no such file; did you mean broken.yaml"),
        ("wrogn.yaml", "wrogn.yaml: there is no such file; did you mean wrong.yaml"),
        ("no/trial", "no/trial: there is no such file"),
        ("lessn", f"unknown trial 'lessn'; did you mean lesson (known: {', '.join(all_bundled())})"),
        ("folder", "folder: is a folder; give the files of a trial"),
        ("latin.yaml", "latin.yaml:2: not UTF-8 text; save the file as UTF-8"),
        ("broken.yaml", "broken.yaml:1: invalid YAML: expected the node content, but found '<stream end>'"),
        ("wrong.yaml", "wrong.yaml:2: options.belt_population_cycles: must be a whole number (got the text 'many')"),
        ("x" * 300, "x" * 300 + ": cannot be read: File name too long"),
    ],
)
@pytest.mark.parametrize("command", ["run", "check"])
def test_unusable_trial_file_is_refused(
    command: str, name: str, message: str, cellwright: CommandLine, tmp_path: Path
) -> None:
    (tmp_path / "folder").mkdir()
    (tmp_path / "latin.yaml").write_bytes("options: {}\n# für\n".encode("latin-1"))
    (tmp_path / "broken.yaml").write_text("options: [")
    (tmp_path / "wrong.yaml").write_text("options:\n  belt_population_cycles: many\n")
    ran = cellwright(command, name)
    if command == "run":
        assert refused(ran) == message
    else:
        assert (ran.status, ran.out, ran.err) == (2, f"error: {message}\n1 error\n", "")


def test_bundled_trial_wins_over_folder_of_same_name(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "lesson").mkdir()
    assert cellwright("check", "lesson").out == "ok\n"


def test_each_error_of_a_file_is_printed_with_its_line(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("option: {}\ntime_limit: x\n")
    ran = cellwright("run", "a.yaml")
    assert ran.status == 2
    assert ran.out == ""
    assert ran.err.splitlines() == [
        "error: a.yaml:1: option: unknown top-level entry; did you mean options",
        "error: a.yaml:2: time_limit: must be a number (got the text 'x')",
    ]


def test_unknown_topic_of_listen_is_refused_with_suggestion(cellwright: CommandLine) -> None:
    message = refused(cellwright("run", "lesson", *UNTIL, "--listen", "/ariac/order"))
    assert message.startswith("--listen: unknown topic '/ariac/order'; did you mean /ariac/orders (known: ")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("run",), "no trial given; name one such as lesson"),
        (("rn",), "No such command 'rn'"),
        (("check",), "Missing argument 'TRIAL'"),
    ],
)
def test_invalid_arguments_of_a_command_are_refused(
    arguments: tuple[str, ...], message: str, cellwright: CommandLine
) -> None:
    assert refused(cellwright(*arguments)).startswith(message)


def test_checkpoint_of_another_cell_is_refused(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "a.yaml").write_text("arm: {type: ur10}\n")
    assert cellwright("run", "a.yaml", *UNTIL, "--checkpoint", "0.05:a.npz").status == 0
    ran = cellwright("run", "lesson", *UNTIL, "--resume", "a.npz")
    assert ran.status == 2
    assert ran.err == "error: a.npz: the checkpoint was made with another cell or another version\n"
    assert cellwright("run", "lesson", *UNTIL, "--resume", "no.npz").err.startswith("error: no.npz: not a checkpoint")


def test_model_refused_by_engine_is_reported_as_error(cellwright: CommandLine, tmp_path: Path) -> None:
    (tmp_path / "knob.xml").write_text("<mujoco><worldbody><geom type='bx'/></worldbody></mujoco>")
    (tmp_path / "a.yaml").write_text("cellwright: {parts: {knob_part: {file: knob.xml}}}\n")
    ran = cellwright("check", "a.yaml")
    assert ran.status == 2
    assert ran.out.startswith("error: knob.xml: ")
    assert ran.out.endswith("1 error\n")
    assert refused(cellwright("run", "a.yaml", *UNTIL)).startswith("knob.xml: ")


SIGNS = "\x1b[2J\x9b31m\u202e"


@pytest.mark.parametrize("command", ["check", "run"])
def test_signs_that_a_terminal_obeys_are_escaped_in_messages(cellwright: CommandLine, command: str) -> None:
    Path("model.xml").write_text(
        f"<mujoco><worldbody><geom type='box' size='1 1 1' material='{SIGNS[4:]}'/></worldbody></mujoco>"
    )
    Path("part.yaml").write_text("cellwright: {parts: {a_part: {file: model.xml, mass: 0.1}}}\n")
    ran = cellwright(command, "part.yaml")
    assert ran.status == 2
    assert r"\x9b31m\u202e" in ran.out + ran.err
    assert all(sign.isprintable() or sign == "\n" for sign in ran.out + ran.err)


@pytest.mark.parametrize(
    "arguments", [("check", SIGNS), ("run", SIGNS), ("eval", "lesson", "--agent", SIGNS), (SIGNS,)]
)
def test_signs_in_names_are_escaped(cellwright: CommandLine, arguments: tuple[str, ...]) -> None:
    ran = cellwright(*arguments)
    assert ran.status == 2
    assert all(sign.isprintable() or sign == "\n" for sign in ran.out + ran.err)
