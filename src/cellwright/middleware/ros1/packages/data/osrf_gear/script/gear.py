#!/usr/bin/env python3
"""Starts the cell: `rosrun osrf_gear gear.py -f CONFIG`. Cellwright does the work, under its own Python.

Whatever Python runs this file, an old one included, it makes room for that one and for nothing of its own.
"""

import os
import sys

PYTHON = "@CELLWRIGHT_PYTHON@"
PLACE = "@CELLWRIGHT_PLACE@"
START = (
    "import sys; sys.path.insert(0, {!r}); from cellwright.cli.launchers.gear.__main__ import main; sys.exit(main())"
)

if __name__ == "__main__":
    try:
        os.execv(PYTHON, [PYTHON, "-E", "-P", "-c", START.format(PLACE)] + sys.argv[1:])
    except OSError as error:
        sys.stderr.write("Error: Cellwright's Python cannot be started: {}: {}\n".format(PYTHON, error.strerror))
        sys.stderr.write(
            "Error: was Cellwright moved? Run `cellwright ros1-env` or `cellwright ros1-workspace` again\n"
        )
        sys.exit(1)
