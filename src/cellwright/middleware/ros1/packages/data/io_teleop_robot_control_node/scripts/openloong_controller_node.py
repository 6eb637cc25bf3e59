#!/usr/bin/env python3
"""The QingLong's node: `rosrun io_teleop_robot_control_node openloong_controller_node.py`.

Whatever Python runs this file, an old one included, it makes room for Cellwright's own.
"""

import os
import sys

PYTHON = "@CELLWRIGHT_PYTHON@"
PLACE = "@CELLWRIGHT_PLACE@"
START = (
    "import sys; sys.path.insert(0, {!r}); "
    "from cellwright.cli.launchers.io_teleop.__main__ import main; sys.exit(main())"
)

if __name__ == "__main__":
    try:
        os.execv(PYTHON, [PYTHON, "-E", "-P", "-c", START.format(PLACE), os.path.abspath(__file__)] + sys.argv[1:])
    except OSError as error:
        sys.stderr.write("error: Cellwright's Python cannot be started: {}: {}\n".format(PYTHON, error.strerror))
        sys.stderr.write(
            "error: was Cellwright moved? Run `cellwright ros1-env` or `cellwright ros1-workspace` again\n"
        )
        sys.exit(1)
