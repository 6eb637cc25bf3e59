"""The bridge between a served cell and ROS 1; run by the path of this file under the python3 that has rospy.

What it prints on stdout is one line, `ready`, when everything is registered. All else goes to stderr, in lines. It ends
with status 0 when the cell ends or it is told to, 1 when it cannot start, and 75 when a new ROS master answers, to
which it would have to register everything anew: then it is to be started again.
"""

from __future__ import annotations

import argparse
import sys
import types
from pathlib import Path

if __name__ == "__main__":
    # Cellwright's own package is not installed here, and needs what is not either: only these parts of it are loaded.
    sys.path[:] = [folder for folder in sys.path if folder != str(Path(__file__).parent)]
    cellwright = types.ModuleType("cellwright")
    cellwright.__path__ = [str(Path(__file__).resolve().parents[3])]
    sys.modules["cellwright"] = cellwright

    from cellwright.middleware.ros1.bridge.bridge import AUTO, NONE, Bridge
    from cellwright.middleware.ros1.bridge.connection import address_of

    parser = argparse.ArgumentParser(prog="bridge", description="A served cell as a node of ROS 1.")
    parser.add_argument("--connect", metavar="HOST:PORT", type=address_of, required=True, help="where it is served")
    parser.add_argument("--name", metavar="/NODE", default="/gazebo", help="name of the node (%(default)s)")
    parser.add_argument(
        "--robot-state-publisher",
        metavar="PATH",
        default=AUTO,
        help=f"the program that makes the frames of the arm; `{AUTO}` looks for it, `{NONE}` does without",
    )
    options = parser.parse_args()
    Bridge(options.connect, options.name, options.robot_state_publisher).run()
