"""Parent watch: becomes another program that ends when the process that started it ends, for whatever reason.

    python3 parent_watch.py PARENT SIGNAL PROGRAM ARGUMENT…

A killed process cannot end its children. On Linux the kernel can: it sends SIGNAL when the thread that started this
program is gone. Elsewhere the program runs without the watch. This file runs alone, under any Python 3.
"""

import ctypes
import os
import signal
import sys

_PR_SET_PDEATHSIG = 1


def main() -> None:
    """Tie this process to its parent and become the program."""
    parent, number, program = int(sys.argv[1]), int(sys.argv[2]), sys.argv[3:]
    # Background programs of a shell ignore Ctrl-C.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, number)
        if os.getppid() != parent:  # it has already gone
            sys.exit(0)
    try:
        os.execvp(program[0], program)  # noqa: S606
    except OSError as error:
        sys.exit(f"{program[0]}: {error.strerror}")


if __name__ == "__main__":
    main()
