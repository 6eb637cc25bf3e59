"""Lines for the user's shell, which sets and unsets variables with them."""

import shlex
import subprocess
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st

from cellwright.cli.shell import shell_lines
from tests.support.waiting import TIMEOUT


@given(st.text(st.characters(exclude_characters="\0", codec="utf-8"), max_size=30))
def test_shell_lines_quote_random_values(value: str) -> None:
    assert shlex.split(shell_lines({"PYTHONPATH": value}, "sh"), comments=False) == ["export", f"PYTHONPATH={value}"]


def test_bash_evaluates_shell_lines(tmp_path: Path) -> None:
    awkward = "a 'quoted' $HOME `pwd` \\ path"
    ran = subprocess.run(
        ["bash", "-c", 'eval "$1"; printf %s "$PYTHONPATH"', "bash", shell_lines({"PYTHONPATH": awkward}, "sh")],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=True,
    )
    assert ran.stdout == awkward


def test_shell_lines_for_fish_set_lists() -> None:
    assert shell_lines({"PATH": "/a:/it's", "PYTHONPATH": "/a:/b"}, "fish").splitlines() == [
        "set -gx PATH '/a' '/it\\'s'",
        "set -gx PYTHONPATH '/a:/b'",
    ]


def test_bash_unsets_variable_without_value() -> None:
    lines = shell_lines({"GONE": None, "THERE": "yes"}, "sh")
    ran = subprocess.run(
        ["bash", "-c", 'eval "$1"; printf %s "${GONE-unset} $THERE"', "bash", lines],
        env={"GONE": "here"},
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=True,
    )
    assert ran.stdout == "unset yes"
    assert shell_lines({"GONE": None}, "fish") == "set -e GONE"
