"""A scripted policy picks a gear from a running belt: the cup goes to where the newest picture shows the gear.

`python picker.py` serves it as OpenPI's servers do, at ws://127.0.0.1:8000. Without a server it is `picker.py:Picker`.
"""

import math

import numpy as np
from websockets.sync.server import serve

from cellwright.clients.policies.array_forms import OPENPI
from cellwright.clients.policies.codec import pack, unpack

CAMERA, FOV = (1.9, 0.0, 1.7), 1.0
"""Place of the camera in the world [m], which looks along -x and 45 degrees down, and its horizontal angle [rad]."""
MIDDLE, TOP = 1.1, 0.912
"""Middle of the belt along x, and the height of the gear's top [m]."""
YELLOW = 2.0
"""Least ratio of red to blue in the gear's colours; nothing else in the picture has it."""
HOVER, DOWN, UP = 0.12, (0.3, 0.05), -0.2
"""Way down to the gear [m]; the places of the gear along y [m] between which the cup goes down, and where up again."""
NEAR, ENOUGH = 0.012, 10
"""Height of the cup over the gear [m] at which it is down, and number of pictures of it down after which it goes up."""
RISE, COUNT = 0.05, 12
"""Way up in a control period [m], and number of actions in an answer."""


class Picker:
    def __init__(self):
        self.down = 0  # a gear that is held stays at the cup, so its place does not tell when to go up
        self.rises = False

    def infer(self, observation):
        _, y, z = (float(each) for each in observation["tool"])
        seen = self.place(observation["picture"])
        self.down += z < TOP + NEAR
        self.rises = self.rises or self.down >= ENOUGH or (seen is not None and seen < UP)
        heights = [TOP + HOVER] * COUNT
        if self.rises:
            heights = [min(z + RISE * each, TOP + HOVER) for each in range(1, COUNT + 1)]
        elif seen is not None and seen < DOWN[0]:
            y = seen
            heights = [TOP + np.interp(seen, (DOWN[1], DOWN[0]), (0.0, HOVER))] * COUNT
        return {"actions": [[MIDDLE, y, height, 1.0] for height in heights]}

    def place(self, picture):
        """Return where the gear is along the belt [m]: the ray of its middle meets the plane of its top."""
        colours = np.asarray(picture, float)
        rows, columns = np.nonzero(colours[:, :, 0] > YELLOW * colours[:, :, 2])
        if not rows.size:
            return None
        height, width = colours.shape[:2]
        pixel = 2.0 * math.tan(FOV / 2.0) / width
        right, down = (columns.mean() - (width - 1) / 2) * pixel, (rows.mean() - (height - 1) / 2) * pixel
        distance = (CAMERA[2] - TOP) / ((1.0 + down) * math.sqrt(0.5))
        return CAMERA[1] + right * distance  # the camera looks along -x, so +y is on its right


def answer(connection):
    """Answer a connection: the metadata first, then an answer to each observation."""
    picker = Picker()
    connection.send(pack({}, OPENPI))
    for request in connection:
        connection.send(pack(picker.infer(unpack(request, OPENPI)), OPENPI))


if __name__ == "__main__":
    with serve(answer, "127.0.0.1", 8000, compression=None) as server:
        server.serve_forever()
