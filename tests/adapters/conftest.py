"""The client of a served environment and the adapters, which are installed nowhere."""

import sys
from pathlib import Path

ADAPTERS = Path(__file__).parents[2] / "adapters"
CLIENT = ADAPTERS / "cellwright_env"

sys.path += map(str, sorted(ADAPTERS.iterdir()))
