"""Forces from outside on points of the arm."""

from typing import Any

import numpy as np

from modrob_cli.arrays import Array
from modrob_cli.model.scenario import Contact


class ContactForces:
    """Turns contact forces into joint torques; adds a frame to the Pinocchio model for each contact."""

    def __init__(self, model: Any, contacts: tuple[Contact, ...]) -> None:
        import pinocchio as pin

        self.contacts = contacts
        self._frames = []
        for k, contact in enumerate(contacts):
            place = pin.SE3(np.eye(3), contact.point)
            frame = pin.Frame(f"modrob_contact_{k}", contact.link, 0, place, pin.FrameType.OP_FRAME)
            self._frames.append(model.addFrame(frame))
        self._model = model
        self._data = model.createData()

    def active(self, t: float, h: float) -> tuple[int, ...]:
        """Contacts that push during a step from t to t + h, which must not reach over the ends of their windows."""
        middle = t + 0.5 * h
        return tuple(k for k, contact in enumerate(self.contacts) if contact.start <= middle < contact.end)

    def breaks(self) -> list[float]:
        """Times at which forces jump, increasing, [s]."""
        return sorted({time for contact in self.contacts for time in (contact.start, contact.end)})

    def torque(self, active: tuple[int, ...], t: float, q: Array) -> Array:
        """Joint torques of the active contacts, shape (n,)."""
        import pinocchio as pin

        tau = np.zeros(len(q))
        for k in active:
            J = pin.computeFrameJacobian(
                self._model, self._data, q, self._frames[k], pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
            )
            tau += J[:3].T @ self.force_in_base(k, t, self._data.oMf[self._frames[k]].rotation)
        return tau

    def force_in_base(self, k: int, t: float, rotation: Array) -> Array:
        """Force of contact k at time t in the base frame, shape (3,); ``rotation`` is that of the contact's link."""
        contact = self.contacts[k]
        size = 1.0 if contact.shape == "constant" else np.sin(np.pi * (t - contact.start) / contact.duration)
        return np.asarray(size * (contact.force if contact.frame == "base" else rotation @ contact.force))
