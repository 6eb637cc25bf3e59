"""Program of a test: steps of a vector in several processes, as a pickle on its output.

Its server of processes ends with it, and not with the process of the tests.
"""

from __future__ import annotations

import pickle
import sys
from functools import partial

import gymnasium
from gymnasium.vector import AsyncVectorEnv

from tests.envs.stories import COUNT, ID, story

if __name__ == "__main__":
    found = story(AsyncVectorEnv([partial(gymnasium.make, ID)] * COUNT, context="forkserver"))
    sys.stdout.buffer.write(pickle.dumps(found))
