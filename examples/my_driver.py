"""A driver for `cellwright teleop ROBOT --driver my_driver.py:MyDriver`: start yours from here.

It stands for hardware: each joint follows its target with a lag, as fast as the URDF lets it. In yours,
`command` and `read` talk to hardware. All methods are called by one thread, and may take their time: a reading at least
100 times a second is good, none for half a second counts as failure. Whatever they raise has the robot held.
"""

import time

import numpy as np

LAG = 0.1  # [s]


class MyDriver:
    def __init__(self, config):
        """Find the robot and switch it on. `config` is its configuration: config.robot.driven are its joints."""
        joints = config.robot.driven
        self.joints = tuple(joint.name for joint in joints)  # those that this driver moves; not all have to be there
        self._velocity = np.array([joint.limits.velocity for joint in joints])
        self._positions = np.array([config.start.get(name, 0.0) for name in self.joints])
        self._targets = self._positions.copy()
        self._read = time.monotonic()

    def command(self, targets):
        """Go to these positions [rad; m], in the order of `joints`: within limits, and past all safety."""
        self._targets = np.array(targets)

    def read(self):
        """Positions [rad; m], velocities [rad/s; m/s] and efforts [N m; N] as they are now."""
        now = time.monotonic()
        seconds, self._read = now - self._read, now
        velocities = np.clip((self._targets - self._positions) / LAG, -self._velocity, self._velocity)
        self._positions = self._positions + velocities * min(seconds, LAG)
        return self._positions, velocities, np.zeros(len(self.joints))

    def close(self):
        """Have the robot stand still, and let go of it."""
        self._targets = self._positions
