"""`AssembledRobot` for nodes of ROS, under the Python that ROS has.

The robot itself moves in a process of Cellwright's own Python; here is only what speaks to it, which needs nothing but
the standard library.
"""

import os
import sys
import types

PYTHON = "@CELLWRIGHT_PYTHON@"
PLACE = "@CELLWRIGHT_PLACE@"

if "cellwright" not in sys.modules:
    # Only these parts are loaded: what else lies beside them belongs to another Python.
    _cellwright = types.ModuleType("cellwright")
    _cellwright.__path__ = [os.path.join(PLACE, "cellwright")]
    sys.modules["cellwright"] = _cellwright

from cellwright.clients.assembled import AssembledRobot as _AssembledRobot  # noqa: E402


class AssembledRobot(_AssembledRobot):
    __doc__ = _AssembledRobot.__doc__
    python = PYTHON
