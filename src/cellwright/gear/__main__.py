"""The launcher's way in: the script `gear.py` of the package `osrf_gear`, or `python -m cellwright.gear`."""

from __future__ import annotations

import signal
import sys

_INTERRUPTED = 130


def main() -> int:
    """Run the launcher with the arguments of the process; its exit status.

    Until there is something to end, a Ctrl-C ends the process, and nothing is said.
    """
    is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_usual:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from cellwright.gear.launcher import main as launch

    if is_usual:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return launch(sys.argv[1:])
    except KeyboardInterrupt:
        return _INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
