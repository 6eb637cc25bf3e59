"""The command line's way in: `cellwright`, and `python -m cellwright` where the command itself is not on the path."""

from __future__ import annotations

import sys

from cellwright.loading import interrupts_end_the_process
from cellwright.standard_streams import StandardStreams


def main() -> int:
    """Run the command line; its exit status."""
    try:
        with interrupts_end_the_process():
            streams = StandardStreams()
            from cellwright.cli.main import main as run_command_line

        return streams.status(run_command_line())
    except KeyboardInterrupt:  # between two lines of ours, where nobody waits for one
        sys.stderr.write("interrupted\n")
        return 1


if __name__ == "__main__":
    sys.exit(main())
