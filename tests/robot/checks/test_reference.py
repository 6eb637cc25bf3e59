"""Invalid reference files are refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

from cellwright.robot.checks import reference
from cellwright.robot.checks.reference import read_reference
from cellwright.util.errors import UsageError


@pytest.mark.parametrize(
    "content",
    [
        "",
        "[]",
        "3",
        "{}",
        "[" * 60_000,
        '{"steps_per_second": 1e400}',
        '{"steps_per_second": "\\u001b[2J"}',
        "\0",
        "1" * 5000,
    ],
)
def test_invalid_content_is_refused_with_path(tmp_path: Path, content: str) -> None:
    path = tmp_path / "reference_motion.json"
    path.write_text(content)
    with pytest.raises(UsageError, match="not a recorded motion") as raised:
        read_reference(path)
    assert str(raised.value).startswith(f"{path}: ")
    assert str(raised.value).isprintable()


def test_endless_file_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reference, "MAX_FILE_SIZE", 1 << 20)
    (tmp_path / "endless.json").symlink_to("/dev/zero")
    with pytest.raises(UsageError, match="larger than 1 MiB"):
        read_reference(tmp_path / "endless.json")
