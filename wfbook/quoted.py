"""What the papers report: every number and every outcome that ours stand beside, and where it is printed.

These are the only results in the library that are typed in by hand. A number is kept as it is printed, so
that what follows from several of them can be checked against them. Figures 8 to 12 are gait diagrams and
figure 13 shows paths, all without numbers: what the text says about them is here in words. Paper A reports
neither errors of its controller nor of its estimator, and no hardware.
"""

from dataclasses import dataclass


@dataclass(frozen=True)
class Quoted:
    """One number or one statement of a paper.

    Attributes:
        key: its name here.
        where: section, figure or table.
        says: what it is a number of; or what the paper states, in short.
        value: the number as printed; None for a statement in words.
        unit: of the value; "1" for ratios.
        unused: why nothing of ours stands beside it; empty if something does.
    """

    key: str
    where: str
    says: str
    value: float | None = None
    unit: str = ""
    unused: str = ""


PAPER_A = (
    # IV, before A: how it was simulated.
    Quoted("delay", "IV", "delay between commanded and acting torque", 9.0, "ms"),
    Quoted("gazebo", "IV", "version of Gazebo, with ODE", unused="simulated in MuJoCo instead"),
    Quoted(
        "gurobi", "IV", "Gurobi 12 on a Core Ultra 7 115H", unused="searched by SCIP and Clarabel instead"
    ),
    # IV-A: which gait and which end effectors. Fig. 7 shows the terrains, without a measure.
    Quoted("fig8.duration", "IV-A.1, Fig. 8", "duration of the gait diagram", 4.5, "s"),
    Quoted("fig8.start", "IV-A.1, Fig. 8", "starts with feet, switches all legs to wheels early"),
    Quoted("fig8.feet_at_end", "IV-A.1, Fig. 8", "legs returned to a foot, to stop", 1, "legs"),
    Quoted("fig8.wheels_at_end", "IV-A.1, Fig. 8", "legs on wheels at the end", 3, "legs"),
    Quoted("fig9.more_feet", "IV-A.2, Fig. 9", "with friction, more foot contacts than without"),
    Quoted("fig9.mostly_wheels", "IV-A.2, Fig. 9", "with friction, most contacts remain wheels"),
    Quoted("fig10.rolls_down", "IV-A.3, Fig. 10", "switches to wheels to roll down the ramp"),
    Quoted("fig10.crosses", "IV-A.3, Fig. 10", "wheels roll across planes of one group, without a swing"),
    Quoted("fig10.stops", "IV-A.3, Fig. 10", "switches back to a foot at the end of the ramp, to stop"),
    Quoted("fig11.mixed", "IV-A.4, Fig. 11", "feet and wheels together at the beginning of the ramp"),
    Quoted("fig11.feet", "IV-A.4, Fig. 11", "all feet once the wheels have lost their forward velocity"),
    Quoted("fig12.gap", "IV-A.5, Fig. 12", "space between stepping stones", 20.0, "cm"),
    Quoted("fig12.step", "IV-A.5, Fig. 12", "the robot's longest step", 50.0, "cm"),
    Quoted("fig12.feet", "IV-A.5, Fig. 12", "feet where rollable space is limited"),
    # IV-B: speed. Fig. 13 shows the paths whose ends these are.
    Quoted("speed.duration", "IV-B, Fig. 13", "duration", 4.5, "s"),
    Quoted("feet.distance", "IV-B, Fig. 13", "distance, feet only", 1.43, "m"),
    Quoted(
        "friction.distance", "IV-B, Fig. 13", "distance, feet and wheels, with rolling friction", 2.5, "m"
    ),
    Quoted("both.distance", "IV-B, Fig. 13", "distance, feet and wheels, without friction", 3.4, "m"),
    Quoted("feet.speed", "IV-B", "mean speed, feet only", 0.32, "m/s"),
    Quoted("friction.speed", "IV-B", "mean speed, feet and wheels, with rolling friction", 0.56, "m/s"),
    Quoted("both.speed", "IV-B", "mean speed, feet and wheels, without friction", 0.76, "m/s"),
    Quoted("friction.faster", "IV-B, V", "faster than feet only, with rolling friction", 74.0, "%"),
    Quoted("both.faster", "IV-B, V", "faster than feet only, without friction", 137.0, "%"),
    # IV-C: cost of transport.
    Quoted("transport.duration", "IV-C", "duration", 9.0, "s"),
    Quoted("both.cot", "IV-C", "cost of transport, feet and wheels", 0.105, "1"),
    Quoted("feet.cot", "IV-C", "cost of transport, feet only", 0.237, "1"),
    Quoted("cot.reduction", "IV-C", "reduction of the cost of transport", 55.7, "%"),
    Quoted("cot.improvement", "IV-C", "improvement of the cost of transport, about", 2.3, "1"),
    Quoted(
        *(
            "cot.reduction_concluded",
            "V",
            "reduction of the cost of transport, in the conclusions",
            57.0,
            "%",
        ),
        unused="IV-C's own two costs give 55.7 %, which it says itself",
    ),
    # IV-D: Table II, by regions, end-effector types and slots.
    Quoted("table2.short", "IV-D, Table II", "duration of five slots", 1.5, "s"),
    Quoted("table2.long", "IV-D, Table II", "duration of ten slots", 3.0, "s"),
    Quoted("table2.1,1,5", "IV-D, Table II", "search time, flat", 0.714, "s"),
    Quoted("table2.1,1,10", "IV-D, Table II", "search time, flat", 4.637, "s"),
    Quoted("table2.1,2,5", "IV-D, Table II", "search time, flat", 1.723, "s"),
    Quoted("table2.1,2,10", "IV-D, Table II", "search time, flat", 673.58, "s"),
    Quoted("table2.3,1,5", "IV-D, Table II", "search time, down ramp", 0.977, "s"),
    Quoted("table2.3,1,10", "IV-D, Table II", "search time, down ramp", 204.37, "s"),
    Quoted("table2.3,2,5", "IV-D, Table II", "search time, down ramp", 3.887, "s"),
    Quoted("times.grow", "IV-D", "time grows with the number of regions, end-effector types and slots"),
    Quoted("times.harder", "IV-D", "rolling friction and rolling between regions take further time"),
    Quoted("times.half_second", "V", "up to five slots are planned within", 0.5, "s"),
)
"""*Trajectory Optimization Through Mixed-Integer Optimization of Contact Dynamics for Switching End Effector
Locomotion*, sections IV and V, in reading order."""

_BY_KEY = {quoted.key: quoted for quoted in PAPER_A}


def quoted(key: str) -> Quoted:
    """Return what a paper reports under a name.

    Raises:
        KeyError: there is nothing of this name.
    """
    return _BY_KEY[key]


def value(key: str) -> float:
    """Return the number that a paper reports under a name.

    Raises:
        KeyError: there is nothing of this name.
        ValueError: it is a statement in words.
    """
    number = quoted(key).value
    if number is None:
        raise ValueError(f"{key}: is no number but says {quoted(key).says!r}")
    return number
