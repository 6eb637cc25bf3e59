"""Seeds of an evaluation: the numbers from 1 on, or those of a file."""

from collections.abc import Sequence
from pathlib import Path

from cellwright.util.errors import UsageError

MAX_SEEDS = 100_000
"""Greatest number of seeds of an evaluation."""
MAX_SEED = 2**63 - 1
"""Greatest seed."""
_MAX_BYTES = 4 << 20  # of a file: 100,000 seeds of 20 digits, and comments


def read_seeds(text: str) -> Sequence[int]:
    """Return the seeds that an option names.

    Args:
        text: a number N, for the seeds 1 to N, or a file with a seed a line; `#` begins a comment.

    Raises:
        UsageError: it is neither, a line is no seed, or one comes twice.

    Example:
        >>> list(read_seeds("3"))
        [1, 2, 3]
    """
    words = text.strip()
    if words.lstrip("+-").isdecimal():
        count = int(words)
        if not 1 <= count <= MAX_SEEDS:
            raise UsageError(f"{text}: give a number from 1 to {MAX_SEEDS}")
        return range(1, count + 1)
    path = Path(text)
    if not path.is_file():
        raise UsageError(
            f"{text}: is no number of seeds and no file; give a number from 1, or a file with a seed a line"
        )
    return _seeds_of(path)


def _seeds_of(path: Path) -> list[int]:
    try:
        if path.stat().st_size > _MAX_BYTES:
            raise UsageError(f"{path}: is larger than {_MAX_BYTES >> 20} MiB; give at most {MAX_SEEDS} seeds")
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UsageError(f"{path}: cannot be read: {error}") from None
    found: dict[int, int] = {}
    for number, line in enumerate(lines, 1):
        word = line.partition("#")[0].strip()
        if not word:
            continue
        if not (word.isascii() and word.isdecimal()) or int(word) > MAX_SEED:
            raise UsageError(f"{path}:{number}: must be a whole number from 0 to {MAX_SEED} (got {word[:40]})")
        if int(word) in found:
            raise UsageError(f"{path}:{number}: {word} is in line {found[int(word)]} too; leave one out")
        found[int(word)] = number
    if not 1 <= len(found) <= MAX_SEEDS:
        raise UsageError(f"{path}: must have 1 to {MAX_SEEDS} seeds, one a line (got {len(found)})")
    return [*found]
