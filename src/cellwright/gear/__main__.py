"""The launcher's way in: the script `gear.py` of the package `osrf_gear`, or `python -m cellwright.gear`."""

from __future__ import annotations

import sys

from cellwright.loading import interrupts_end_the_process

_INTERRUPTED = 130


def main() -> int:
    """Run the launcher with the arguments of the process; its exit status."""
    try:
        with interrupts_end_the_process():
            from cellwright.gear.launcher import main as launch

        return launch(sys.argv[1:])
    except KeyboardInterrupt:
        return _INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
