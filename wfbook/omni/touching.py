"""Chapter 11: contacts beside those of eq. 4's ten rows, for whoever wants to see what they do.

``hand`` leans on a point of a wall ahead, as Paper B's manipulator may when it works: three rows, and a force
that presses and stays within a friction pyramid. ``axle`` is a mistake that the paper's words invite: it
leaves the moment about the axle free. A contact with a moment is held about that axis, too, so the wheel
stands on the ground as if it were glued to it.
"""

import crocoddyl
import numpy as np
import pinocchio as pin

from wfbook.omni.locked import held_rows

ALSO = ("hand", "axle")
"""Contacts that there may be beside the wheels'."""

WALL = np.array([[0.0, 0.0, -1.0], [0.0, 1.0, 0.0], [1.0, 0.0, 0.0]])
"""Axes of the contact on the wall, in the world's: its normal z points back at the robot."""

_AXLE = 4


class Glued(crocoddyl.ContactModelAbstract):
    """A wheel that can't tilt about its axle, and the moment about it that takes: one row.

    It is the fifth row of Crocoddyl's contact of six.

    Args:
        state: the robot's.
        frame: of the contact; y is the axle.
        nu: number of torques.
        gains: ``(2,)`` of the contact's own spring and damper.
    """

    def __init__(self, state: crocoddyl.StateMultibody, frame: int, nu: int, gains: np.ndarray) -> None:
        super().__init__(state, pin.LOCAL, 1, nu)
        self.id = frame
        self._whole = crocoddyl.ContactModel6D(state, frame, pin.SE3.Identity(), pin.LOCAL, nu, gains)

    def createData(self, data: pin.Data) -> "GluedData":
        """Return what a node keeps."""
        return GluedData(self, data)

    def calc(self, data: "GluedData", x: np.ndarray) -> None:
        """Find the row of the Jacobian and its drift."""
        self._whole.calc(data.whole, x)
        data.Jc = data.whole.Jc[_AXLE : _AXLE + 1]
        data.a0 = data.whole.a0[_AXLE : _AXLE + 1]

    def calcDiff(self, data: "GluedData", x: np.ndarray) -> None:
        """Find the drift's derivative."""
        self._whole.calcDiff(data.whole, x)
        data.da0_dx = data.whole.da0_dx[_AXLE : _AXLE + 1]

    def updateForce(self, data: "GluedData", force: np.ndarray) -> None:
        """Take the moment ``(1,)`` about the axle, in the contact's frame."""
        moment = np.zeros(6)
        moment[_AXLE] = force[0]
        data.f = pin.Force(moment)
        data.fext = data.whole.jMf.act(data.f)


class GluedData(crocoddyl.ContactDataAbstract):
    """What a node keeps of :class:`Glued`."""

    def __init__(self, model: Glued, data: pin.Data) -> None:
        super().__init__(model, data)
        self.frame = model.id
        self.whole = model._whole.createData(data)
        self.jMf, self.fXj = self.whole.jMf, self.whole.fXj


def contacts(
    name: str, state: crocoddyl.StateMultibody, nu: int, gains: np.ndarray
) -> dict[str, crocoddyl.ContactModelAbstract]:
    """Return the contacts of one of :data:`ALSO`, by name.

    Glued are the two wheels that are held in all three directions: two more would make eq. 4 singular. Their
    axles are where they are with the steering straight ahead.

    Raises:
        ValueError: an unknown name.
    """
    if name not in ALSO:
        raise ValueError(f"also: {name!r} is none of {', '.join(ALSO)}")
    frame = state.pinocchio.getFrameId
    if name == "hand":
        model = crocoddyl.ContactModel3D(
            state, frame("hand"), np.zeros(3), pin.LOCAL_WORLD_ALIGNED, nu, gains
        )
        return {"hand": model}
    legs = [leg for leg, rows in held_rows((True,) * 4).items() if rows == "xyz"]
    return {f"{leg}_axle": Glued(state, frame(f"{leg}_axle"), nu, gains) for leg in legs}
