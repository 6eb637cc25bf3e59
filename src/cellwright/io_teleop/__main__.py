"""The way in of the scripts in the package `io_teleop_robot_control_node`; the first argument is the script's path."""

from __future__ import annotations

import signal
import sys

_BAD_INPUT = 2
_INTERRUPTED = 130


def main() -> int:
    """Run the node that a script stands for, with the arguments of the process; its exit status.

    Until there is something to end, a Ctrl-C ends the process, and nothing is said.
    """
    is_usual = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if is_usual:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    from cellwright.cli.main import main as cellwright
    from cellwright.errors import CellwrightError
    from cellwright.io_teleop.arguments import command

    if is_usual:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        return cellwright(command(sys.argv[1], sys.argv[2:], _warn))
    except CellwrightError as error:
        sys.stderr.write(f"error: {error}\n")
        return _BAD_INPUT
    except KeyboardInterrupt:
        return _INTERRUPTED


def _warn(line: str) -> None:
    sys.stderr.write(f"warning: {line}\n")


if __name__ == "__main__":
    sys.exit(main())
