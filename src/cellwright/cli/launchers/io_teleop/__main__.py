"""Entry point of the scripts in the package `io_teleop_robot_control_node`; the first argument is the script's path."""

from __future__ import annotations

import sys

from cellwright.util.process import StandardStreams, silent_ctrl_c

_BAD_INPUT = 2
_INTERRUPTED = 130


def main() -> int:
    """Run the node of a script with the arguments of the process; return its exit status."""
    with silent_ctrl_c():
        streams = StandardStreams()
        from cellwright.cli.launchers.io_teleop.arguments import command
        from cellwright.cli.main import main as cellwright
        from cellwright.util.errors import CellwrightError, printable

    try:
        return streams.status(cellwright(command(sys.argv[1], sys.argv[2:], _warn)))
    except CellwrightError as error:
        sys.stderr.write(f"error: {printable(str(error))}\n")
        return _BAD_INPUT
    except KeyboardInterrupt:
        return _INTERRUPTED


def _warn(line: str) -> None:
    sys.stderr.write(f"warning: {line}\n")


if __name__ == "__main__":
    sys.exit(main())
