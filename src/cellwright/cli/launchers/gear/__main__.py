"""Entry point of the launcher: the script `gear.py` of `osrf_gear`, or `python -m cellwright.cli.launchers.gear`."""

from __future__ import annotations

import sys

from cellwright.util.process import StandardStreams, silent_ctrl_c

_INTERRUPTED = 130


def main() -> int:
    """Run the launcher with the arguments of the process; return its exit status."""
    try:
        with silent_ctrl_c():
            streams = StandardStreams()
            from cellwright.cli.launchers.gear.launcher import main as launch

        return streams.status(launch(sys.argv[1:]))
    except KeyboardInterrupt:
        return _INTERRUPTED


if __name__ == "__main__":
    sys.exit(main())
