"""Expressions of xacro files compute, and do nothing else."""

from pathlib import Path

import pytest
import xacro

from cellwright.config.robot import urdf_file, xacro_program
from cellwright.config.robot.urdf_file import expand_xacro
from cellwright.config.robot.xacro_program import check_expression
from cellwright.util.errors import DescriptionError

ROBOT = '<robot xmlns:xacro="http://ros.org/wiki/xacro">{}</robot>'


def expanded(folder: Path, expression: str) -> str:
    path = folder / "robot.xacro"
    path.write_text(ROBOT.format(f"""<link name="{expression}"/>"""))
    return expand_xacro(path, path.read_text()).partition('name="')[2].partition('"')[0]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("expression", "value"),
    [
        ("${2*pi}", "6.283185307179586"),
        ("${[2*x for x in range(3)][-1]}", "4"),
        ("${dict(a=1)['a'] + max(1, 2)}", "3"),
        ("${python.sorted([2, 1])[0]}", "1"),
        ("${'left'.upper()}", "LEFT"),
        ("${math.hypot(3, 4)}", "5.0"),
        ("$(eval 1 + 1)", "2"),
    ],
)
def test_common_functions_are_evaluated(tmp_path: Path, expression: str, value: str) -> None:
    assert expanded(tmp_path, expression) == value


@pytest.mark.parametrize(
    ("expression", "name"),
    [
        ("().__class__", "__class__"),
        ("[x.__class__ for x in [()]]", "__class__"),
        ("(lambda x: x.__class__)(1)", "__class__"),
        ("f'{().__class__}'", "__class__"),
        ("a._parent", "_parent"),
        ("'{0.real}'.format(1)", "format"),
        ("(x for x in [1]).gi_frame", "gi_frame"),
        ("str.mro()", "mro"),
        ("__import__('os')", "__import__"),
    ],
)
def test_access_to_internals_is_refused(expression: str, name: str) -> None:
    with pytest.raises(xacro.XacroException, match=f"an expression must not use '{name}'"):
        check_expression(expression)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("${[x.__class__ for x in [()]]}", "must not use '__class__'"),
        ("$(eval [x.__class__ for x in 'a'])", "must not use '__class__'"),
        ("${python.vars(1)}", "'vars' is not defined"),
        ("$(eval open)", "'open' is not defined"),
    ],
)
def test_file_with_access_to_internals_is_refused(tmp_path: Path, expression: str, message: str) -> None:
    with pytest.raises(DescriptionError, match=message):
        expanded(tmp_path, expression)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("expression", "message"),
    [
        ("${'x' * 10**10}", "needs more than 1024 MiB of memory"),
        ("${len('x' * 2 * 10**7) and 'x' * 2 * 10**7}", "expands to more than 16 MiB"),
        ("${[0 for a in range(10**9)]}", "takes longer than 1 s|needs more than 1024 MiB"),
        ("${10**10**8}", "takes longer than 1 s|needs more than 1024 MiB"),
    ],
)
def test_unlimited_expression_is_stopped(
    tmp_path: Path, expression: str, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(urdf_file, "MAX_EXPANSION_TIME", 1.0 if "1 s" in message else 60.0)
    with pytest.raises(DescriptionError, match=message):
        expanded(tmp_path, expression)


@pytest.mark.slow
def test_doubling_macros_are_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(urdf_file, "MAX_EXPANSION_TIME", 1.5)
    macros = "".join(f'<xacro:macro name="m{k}"><xacro:m{k - 1}/><xacro:m{k - 1}/></xacro:macro>' for k in range(1, 40))
    path = tmp_path / "robot.xacro"
    with pytest.raises(DescriptionError, match=r"xacro: takes longer than 1\.5 s to expand"):
        expand_xacro(path, ROBOT.format(f'<xacro:macro name="m0"><link name="a"/></xacro:macro>{macros}<xacro:m39/>'))


def test_dead_expansion_process_is_refused_with_status(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(urdf_file, "_PROGRAM", "import os; os._exit(7)")
    with pytest.raises(DescriptionError, match=r"the process ended without a result \(status 7\)"):
        expanded(tmp_path, "a")


def test_expanded_text_limit_equals_robot_file_limit() -> None:
    from cellwright.config.robot.urdf_file import MAX_BYTES

    assert xacro_program.MAX_TEXT == MAX_BYTES
