"""Chapter 12: what the whole-body controller does besides solving its problem; each can be left out.

To see what something is good for, leave it out and simulate.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Habits:
    """What :class:`wfbook.omni.controller.WholeBody` does.

    Attributes:
        predicts: what was measured late is carried on to now, by eq. 4 and the torques that were sent since.
        feeds_back: between two plans, torques follow the gains of eq. 21. Without it they stay as planned.
        starts_warm: each plan begins with the last one. Without it, with standing still.
        looks_ahead: the program is told the ground ahead. Without it, that the ground goes on as it is.
        weighs: the payload is found from how the arm accelerates.
        integrates: the hand's lasting error moves its reference.
        keeps_places: wheels that are not where they belong are sped up and steered back.
    """

    predicts: bool = True
    feeds_back: bool = True
    starts_warm: bool = True
    looks_ahead: bool = True
    weighs: bool = True
    integrates: bool = True
    keeps_places: bool = True
