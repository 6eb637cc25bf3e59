import pytest

from cellwright.middleware.messages import TYPES
from tools.message_classes import FOLDER, modules

SOURCES = modules()


@pytest.mark.parametrize("package", SOURCES)
def test_message_modules_are_up_to_date(package: str) -> None:
    module = FOLDER / f"{package}.py"
    assert module.read_text(encoding="utf-8") == SOURCES[package], "run: python -m tools.message_classes"


def test_message_type_has_one_class() -> None:
    for name, _ in TYPES.parsed():
        package = name.partition("/")[0]
        assert SOURCES[package].count(f'@message_class("{name}")') == 1


def test_comments_and_units_come_from_definition() -> None:
    source = SOURCES["control_msgs"]
    assert "    position: float = 0.0  # [rad] or [m]\n" in source
    assert '    """Result of a trajectory execution."""\n' in source
    assert "    INVALID_JOINTS: ClassVar[int] = -2\n" in source


def test_long_comment_stands_above_field() -> None:
    assert (
        "    # number of messages it has published on each; the step waits until all have arrived\n    published:"
        in SOURCES["cellwright_msgs"]
    )
