"""Small scene for tests, and a strategy for its frames."""

from typing import Any

import mujoco
import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from cellwright.rendering.scene import SceneFrame
from cellwright.rendering.scene.engine import SceneCapture

XML = """
<mujoco>
  <asset>
    <mesh name="wedge" vertex="0 0 0  1 0 0  0 1 0  0 0 1"/>
  </asset>
  <worldbody>
    <geom name="floor" type="plane" size="5 4 .1" group="2"/>
    <body name="stand" pos="1 0 0" euler="0 0 90">
      <geom type="box" size=".1 .2 .3" pos="1 0 0" rgba="0 0 1 1" group="1"/>
      <body name="arm" pos="0 0 1">
        <joint name="swing" axis="0 0 1"/>
        <geom type="capsule" size=".05 .3" pos=".3 0 0" rgba="1 0 0 .5" group="3"/>
        <body name="hand" pos=".6 0 0"><geom type="mesh" mesh="wedge" group="2"/></body>
      </body>
    </body>
    <body name="cart" mocap="true" pos="0 3 0">
      <geom type="ellipsoid" size=".1 .2 .3" group="4"/>
      <body name="load" pos="0 0 .5"><geom type="cylinder" size=".1 .2" group="1"/></body>
    </body>
    <body name="ball" pos="0 0 2"><freejoint/><geom type="sphere" size=".1" group="1"/></body>
    <body name="ghost" pos="0 0 4"><freejoint/><geom type="sphere" size=".1" rgba="0 0 0 0"/></body>
  </worldbody>
</mujoco>
"""


def small() -> tuple[Any, Any, SceneCapture]:
    """Return the engine's model and data, and the capture of their scenes."""
    model = mujoco.MjModel.from_xml_string(XML)
    data = mujoco.MjData(model)
    mujoco.mj_kinematics(model, data)
    return model, data, SceneCapture(model, name="small")


def frames(bodies: int) -> st.SearchStrategy[SceneFrame]:
    """Frames with this number of bodies."""
    numbers = st.floats(-1e3, 1e3, width=32)
    return st.builds(
        SceneFrame,
        st.integers(0, 10**15),
        arrays.arrays(np.float32, (bodies, 7), elements=numbers),
        arrays.arrays(np.bool_, (bodies,)),
    )
