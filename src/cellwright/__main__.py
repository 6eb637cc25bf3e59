"""The command line's way in: `cellwright`, and `python -m cellwright` where the command itself is not on the path."""

from __future__ import annotations

import signal
import sys


def main() -> int:
    """Run the command line; its exit status.

    Loading it takes half a second, in which a Ctrl-C has nothing to tidy up: it ends the process, and nothing is said.
    """
    is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_usual:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from cellwright.cli.main import main as run_command_line

    try:
        if is_usual:
            signal.signal(signal.SIGINT, signal.default_int_handler)
        return run_command_line()
    except KeyboardInterrupt:  # between two lines of ours, where nobody waits for one
        sys.stderr.write("interrupted\n")
        return 1


if __name__ == "__main__":
    sys.exit(main())
