"""The client of a served environment, which is installed nowhere."""

import sys
from pathlib import Path

CLIENT = Path(__file__).parents[2] / "adapters" / "cellwright_env"

sys.path.append(str(CLIENT))
