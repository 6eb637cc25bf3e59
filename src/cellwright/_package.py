"""Version and folder of the package, for modules that would otherwise import the root."""

from __future__ import annotations

import os

VERSION = "0.2.0"
FOLDER = os.path.dirname(os.path.abspath(__file__))
"""Absolute path of the folder `cellwright`."""
