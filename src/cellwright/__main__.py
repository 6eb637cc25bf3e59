"""The command line's way in: `cellwright`, and `python -m cellwright` where the command itself is not on the path."""

from __future__ import annotations

import io
import sys

from cellwright.loading import interrupts_end_the_process
from cellwright.standard_streams import StandardStreams


def main() -> int:
    """Run the command line; its exit status."""
    _take_all_characters()
    try:
        with interrupts_end_the_process():
            streams = StandardStreams()
            from cellwright.cli.main import main as run_command_line

        return streams.status(run_command_line())
    except KeyboardInterrupt:  # between two lines of ours, where nobody waits for one
        sys.stderr.write("interrupted\n")
        return 1


def _take_all_characters() -> None:
    """Let what stdout has no character for be written as its number: a pipe on Windows, or a file's name of odd bytes.

    Python does so for stderr; on stdout it would be an error in the middle of a line.
    """
    if isinstance(sys.stdout, io.TextIOWrapper) and sys.stdout.errors == "strict":
        sys.stdout.reconfigure(errors="backslashreplace")


if __name__ == "__main__":
    sys.exit(main())
