"""The command line's way in: `cellwright`, and `python -m cellwright` where the command itself is not on the path."""

from __future__ import annotations

import sys
import threading

from cellwright.loading import end_despite_threads, interrupts_end_the_process
from cellwright.standard_streams import StandardStreams


def main() -> int:
    """Run the command line; its exit status."""
    before = threading.enumerate()
    try:
        with interrupts_end_the_process():
            streams = StandardStreams()
            from cellwright.cli.main import main as run_command_line

        status = streams.status(run_command_line())
        end_despite_threads(before, status)
        return status
    except KeyboardInterrupt:  # between two lines of ours, where nobody waits for one
        sys.stderr.write("interrupted\n")
        return 1


if __name__ == "__main__":
    sys.exit(main())
