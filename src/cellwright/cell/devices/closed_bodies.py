"""Bodies that are closed to the engine: the fields of its model and of its options that culling writes."""

import mujoco
import numpy as np

from cellwright.engine.bounding_boxes import Numbers

_NO_CONTACTS = int(mujoco.mjtDisableBit.mjDSBL_CONTACT)


class ClosedBodies:
    """Bodies that are closed to a model's collision detection.

    The engine's broad phase asks for `body_contype` and `body_conaffinity` only. With both at 0 a body has no box and
    no pair. Rays and distances ask for the classes of shapes, so sensors see closed bodies as any others.

    Args:
        model: the engine's model, with everything open and as compiled.

    Attributes:
        is_closed: mask of the closed bodies, without those that something carries.
    """

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._contype, self._conaffinity = model.body_contype.copy(), model.body_conaffinity.copy()
        self._gravcomp = model.body_gravcomp.copy()
        self.is_closed = np.zeros(model.nbody, dtype=np.bool_)

    def open(self, bodies: Numbers) -> None:
        """Have bodies collide and weigh again."""
        model = self._model
        self.is_closed[bodies] = False
        model.body_contype[bodies], model.body_conaffinity[bodies] = self._contype[bodies], self._conaffinity[bodies]
        model.body_gravcomp[bodies] = self._gravcomp[bodies]

    def close(self, bodies: Numbers) -> None:
        """Leave bodies out of collision detection."""
        self.is_closed[bodies] = True
        self._model.body_contype[bodies] = self._model.body_conaffinity[bodies] = 0

    def carry(self, body: int, *, is_weightless: bool) -> None:
        """Leave a body that something carries out of collision detection; without weight if nothing holds it up."""
        self._model.body_contype[body] = self._model.body_conaffinity[body] = 0
        if is_weightless:
            self._model.body_gravcomp[body] = 1.0

    @property
    def has_contacts(self) -> bool:
        """True if the engine looks for contacts at all."""
        return not self._model.opt.disableflags & _NO_CONTACTS

    def allow_contacts(self, allowed: bool) -> None:  # noqa: FBT001
        """Have the engine look for contacts, or skip them altogether."""
        if allowed != self.has_contacts:
            self._model.opt.disableflags ^= _NO_CONTACTS
