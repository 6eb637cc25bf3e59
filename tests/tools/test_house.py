from pathlib import Path

import pytest

from tools import house

MODULE = "src/cellwright/cell/belt.py"
CLEAN = '"""Belt."""\n\nSPEED = 0.2\n\n\ndef move() -> float:\n    """Return `SPEED`."""\n    return SPEED\n'


def findings(root: Path, source: str, **more: str) -> list[str]:
    """The findings of a project of one module, and of other files by their paths with `_` for `/`."""
    files = {MODULE: source, "tests/cell/test_belt.py": "from cellwright.cell import belt\n", **more}
    for name, text in files.items():
        (root / name).parent.mkdir(parents=True, exist_ok=True)
        (root / name).write_text(text)
    return [str(each).removeprefix(f"{MODULE}:") for each in house.check(house.Project(root))]


def test_clean_module_has_no_findings(tmp_path: Path) -> None:
    assert findings(tmp_path, CLEAN) == []


@pytest.mark.parametrize(
    ("late", "is_found"),
    [
        ("WIDTH = 2 * SPEED", True),
        ("_WIDTH: float = 1.0", True),
        ("A, B = range(2)", True),
        ("WIDTH = move()", False),
        ("TABLE = {'move': move}", False),
        ("LATER = {'speed': lambda: move()}", True),
        ("width = 1.0", False),
    ],
)
def test_constant_behind_a_definition_is_found_unless_it_needs_it(late: str, is_found: bool, tmp_path: Path) -> None:
    found = findings(tmp_path, f"{CLEAN}\n\n{late}\n")
    assert [each.endswith("a constant behind the first definition; put it before") for each in found] == [
        True
    ] * is_found


def test_constant_that_needs_a_late_constant_may_stand_behind_it(tmp_path: Path) -> None:
    assert findings(tmp_path, f"{CLEAN}\n\nWIDTH = move()\nHALF = WIDTH / 2\n") == []


@pytest.mark.parametrize("place", ['"""Belt, see `{}`."""', "# as `{}` says"])
@pytest.mark.parametrize(
    ("name", "missing"),
    [("stop_belt", "stop_belt"), ("move.halt", "halt"), ("move()", ""), ("cell/belt.py", ""), ("world_T_belt", "")],
)
def test_name_that_no_code_has_is_found(place: str, name: str, missing: str, tmp_path: Path) -> None:
    found = findings(tmp_path, CLEAN + "\n\n" + place.format(name) + "\n")
    assert found == ([f"11: `{name}`: no code has '{missing}'; write the name of today"] if missing else [])


@pytest.mark.parametrize(
    ("path", "is_found"),
    [
        ("cell/belt.py", False),
        ("src/cellwright/cell", False),
        ("belt.py", False),
        ("cell/NAME.py", False),
        ("build/pictures", False),
        ("/cell/state", False),
        ("cell/belts.py", True),
        ("belts.py", True),
        ("tests/cell/NAME/belt.py", True),
    ],
)
def test_path_of_a_page_that_does_not_exist_is_found(path: str, is_found: bool, tmp_path: Path) -> None:
    found = findings(tmp_path, CLEAN, **{"CONTRIBUTING.md": f"Rows\n\nsee `{path}`\n"})
    assert found == [f"CONTRIBUTING.md:3: `{path}`: no such file or folder; write the path of today"] * is_found


def test_file_with_too_many_lines_is_found(tmp_path: Path) -> None:
    lines = CLEAN.count("\n")
    most, more = (CLEAN + "\n" * (house.MAX_LINES - lines + each) for each in (0, 1))
    assert findings(tmp_path, most) == []
    found = findings(tmp_path, more, **{"tests/cell/test_agv.py": more})
    problem = "1: 401 lines (at most 400); split it where its idea changes"
    assert found == [problem, f"tests/cell/test_agv.py:{problem}"]


@pytest.mark.parametrize(
    ("test", "text", "is_found"),
    [
        ("tests/cell/test_wheel.py", "", False),
        ("tests/cell/wheel/test_spokes.py", "", False),
        ("tests/cell/test_cart.py", "from cellwright.cell.wheel import turn\n", False),
        ("tests/cell/test_cart.py", "from cellwright.cell import belt, wheel\n", False),
        ("tests/cell/test_cart.py", "from cellwright.cell import belt, wheels\n", True),
        ("tests/test_wheel.py", "from cellwright.cell import wheel\n", True),
    ],
)
def test_module_without_mirrored_test_is_found(test: str, text: str, is_found: bool, tmp_path: Path) -> None:
    path = "src/cellwright/cell/wheel.py"
    found = findings(tmp_path, CLEAN, **{path: CLEAN, test: text})
    assert found == [f"{path}:1: no mirrored test; add tests/cell/test_wheel.py"] * is_found


@pytest.mark.parametrize(
    "path", ["middleware/ros1/bridge/wheel.py", "middleware/wire/relay.py", "middleware/ros1/packages/data/wheel.py"]
)
def test_module_that_only_ros_loads_is_mirrored_by_tests_with_ros(path: str, tmp_path: Path) -> None:
    assert findings(tmp_path, CLEAN, **{f"src/cellwright/{path}": CLEAN, "tests/ros1/test_wheel.py": ""}) == []


def test_generated_module_needs_no_test(tmp_path: Path) -> None:
    generated = CLEAN.replace("Belt.", "Wheel.\n\nGenerated: run the tool.\n")
    assert findings(tmp_path, CLEAN, **{"src/cellwright/cell/wheel.py": generated}) == []


def test_figures_name_large_functions(tmp_path: Path) -> None:
    body = "".join(f"    x{number} = {number}\n" for number in range(house.MAX_FUNCTION_LINES))
    wide = "def wide(a, b, c, d, e, f, g, h): ...\n@app.command\ndef run(a, b, c, d, e, f, g, h): ...\n"
    findings(tmp_path, f'"""Belt."""\nimport os\n\n# a reason\ndef long():\n    """Long."""\n{body}\n{wide}')
    figures = list(house.figures(house.Project(tmp_path)))
    assert f"  {MODULE}:5 long: {house.MAX_FUNCTION_LINES + 1}" in figures
    assert [each for each in figures if "wide" in each or " run" in each] == [f"  {MODULE}:68 wide: 8"]
    assert any(each.startswith("whole-line comments: 1,") for each in figures)
