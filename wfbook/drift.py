"""Chapter 8: when a robot on passive wheels is not where its plan has it.

A push along the way changes the speed of a robot that rolls, and nothing holds it: neither its controller,
nor, until the next window, its planner. The foot that is to stop it would come down at its place, and the
robot be elsewhere. So from a few centimetres on the plan goes along with the robot, and at its speed: the
robot does what was planned, a little before or behind, faster or slower, and stays upright. To go on from
there to where it should be is the planner's (:mod:`wfbook.receding`).
"""

import numpy as np

from wfbook.go1_dynamics import Go1Dynamics

SLACK = 0.03
"""How far along x a rolling robot may be from its plan before the plan goes along."""

_SLOW = 0.05
_FASTEST = 2.0


class Drift:
    """How far, and how much faster, a robot rolls than planned.

    Attributes:
        offset: ``(3,)`` from the plan to what is to be done.
        pace: factor of the planned velocity along x.
    """

    def __init__(self) -> None:
        self.offset, self.pace = np.zeros(3), 1.0
        self._before = 0.0
        self._until = np.inf

    def end_at(self, t: float) -> None:
        """Note that from a time on there is another plan, which knows where the robot is."""
        self._until = t

    def update(
        self,
        t: float,
        planned: tuple[np.ndarray, np.ndarray, np.ndarray],
        robot: Go1Dynamics,
        rolling: bool,
        normal: np.ndarray,
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Advance to a time, and return what is to be done instead of what is planned.

        Args:
            t: time.
            planned: centre of mass, its velocity and acceleration, ``(3,)`` each.
            robot: dynamics at the present state.
            rolling: whether it stands on wheels alone.
            normal: ``(3,)`` of the ground, along which the offset goes.
        """
        if t >= self._until:
            self.offset, self.pace, self._until = np.zeros(3), 1.0, np.inf
        com, velocity, acceleration = planned
        along = float(self.offset[0])
        if not rolling:
            along += (self.pace - 1.0) * float(com[0] - self._before)
        elif beyond := excess(float(robot.com[0] - com[0]) - along):
            along += beyond
            self.pace = pace_of(float(robot.com_velocity[0]), float(velocity[0]))
        self._before = com[0]
        if along:
            self.offset = np.array([along, 0.0, -along * normal[0] / normal[2]])
        factor = np.array([self.pace, 1.0, 1.0])
        return com + self.offset, factor * velocity, factor * acceleration

    def after(self, way: float) -> np.ndarray:
        """Return the offset ``(2,)`` once the planned centre of mass is some way further along x."""
        return self.offset[:2] + np.array([(self.pace - 1.0) * way, 0.0])


def pace_of(speed: float, planned: float) -> float:
    """Return how many times faster than planned a robot rolls; never backwards."""
    return min(max(speed / planned, 0.0), _FASTEST) if abs(planned) > _SLOW else 1.0


def excess(error: float) -> float:
    """Return by how much an error is more than what a plan can be off a rolling robot."""
    return error - min(max(error, -SLACK), SLACK)
