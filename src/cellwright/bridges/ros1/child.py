"""Becomes another program that ends with this process's parent: `python3 child.py PARENT PROGRAM [ARGUMENT…]`.

The kernel is asked to send SIGINT when the parent is gone, however it went. That must be asked for by the process itself
before it becomes the other program, and may not be done between fork and exec of a parent that has threads.
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
