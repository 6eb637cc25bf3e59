"""Becomes another program that ends with this process's parent: `python3 child.py PARENT PROGRAM [ARGUMENT…]`.

The kernel is asked to send SIGINT when the parent is gone, however it went. The process itself must ask for that before
it becomes the other program; a parent with threads has no safe moment for it between fork and exec.
"""

import ctypes
import os
import signal
import sys

PR_SET_PDEATHSIG = 1

if __name__ == "__main__":
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, int(signal.SIGINT), 0, 0, 0)
    if os.getppid() == int(sys.argv[1]):  # else it was gone before it could be asked for
        os.execv(sys.argv[2], sys.argv[2:])  # noqa: S606
