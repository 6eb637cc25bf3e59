"""A small scene for tests of the simulation: blocks on a table, one of them sliding, one hinged and driven."""

from fractions import Fraction
from typing import Any

import mujoco

from cellwright.engine.device import Device
from cellwright.engine.simulation import Simulation

SCENE = """
<mujoco>
  <option integrator="implicitfast" cone="elliptic"><flag sleep="enable"/></option>
  <worldbody>
    <geom name="table" type="box" size="2 2 .1" pos="0 0 -.1"/>
    <body name="arm" pos="-1 0 .3"><joint name="hinge" axis="0 1 0"/><geom type="capsule" size=".02 .1"/></body>
    <body name="block1" pos="0 0 .051"><freejoint/><geom name="block1" type="box" size=".05 .05 .05"/></body>
    <body name="block2" pos=".5 0 .3" euler="20 30 0"><freejoint/><geom type="box" size=".05 .05 .05"/></body>
    <body name="block3" pos="1 0 .051"><freejoint/><geom type="cylinder" size=".05 .05"/></body>
  </worldbody>
  <actuator><motor name="hinge" joint="hinge"/></actuator>
</mujoco>
"""


def make_simulation(timestep: Fraction = Fraction(1, 500), seed: int = 0) -> Simulation:
    return Simulation(mujoco.MjModel.from_xml_string(SCENE), timestep=timestep, seed=seed)


class Shaker(Device):
    """Device that pushes the hinge at random and periodically: it has a generator, an event and a state."""

    def __init__(self, name: str = "shaker") -> None:
        super().__init__(name)
        self.pushes = 0
        self.effort = 0.0
        self.log: list[tuple[int, int]] = []

    def reset(self) -> None:
        self.pushes = 0
        self.effort = 0.0
        self.simulation.schedule(self, "push", 1, delay=0.05)

    def before_step(self) -> None:
        self.simulation.data.ctrl[0] = self.effort

    def handle(self, kind: str, arguments: tuple[Any, ...]) -> None:
        if kind != "push":
            super().handle(kind, arguments)
        self.pushes += arguments[0]
        self.log.append((self.simulation.now, self.pushes))
        draw = self.simulation.generator(f"{self.name}/{self.pushes}").normal()
        self.effort = float(draw)
        self.simulation.schedule(self, "push", 1, delay=0.05)

    def get_state(self) -> dict[str, Any]:
        return {"pushes": self.pushes, "effort": self.effort}

    def set_state(self, state: Any) -> None:
        self.pushes = state["pushes"]
        self.effort = state["effort"]
