"""What the papers report: every number and every outcome that ours stand beside, and where it is printed.

These are the only results in the library that are typed in by hand. A number is kept as it is printed, so
that what follows from several of them can be checked against them. Figures 8 to 12 are gait diagrams and
figure 13 shows paths, all without numbers: what the text says about them is here in words. Paper A reports
neither errors of its controller nor of its estimator, and no hardware. Paper B's hardware is described in
words alone; its figures' curves are not in its text.
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

_SIX, _FIXED, _MODES = "Paper B, Fig. 6", "Paper B, Fig. 7a", "Paper B, Fig. 7b"
_TURN, _SQUAT, _TIMES = "Paper B, Figs. 8a, 9, 10", "Paper B, Fig. 8b", "Paper B, Formulation"
_PLATFORM = "Paper B, Results"


def _hand(key: str, where: str, height: tuple, roll: tuple, pitch: tuple, yaw: tuple) -> tuple[Quoted, ...]:
    """Return a simulation's figures of the hand: means, deviations, and the largest error of its height."""
    mean, std, most = height
    numbers = [Quoted(f"{key}.mean", where, "hand's height, mean", mean, "m")]
    numbers.append(Quoted(f"{key}.std", where, "hand's height, standard deviation", std, "m"))
    numbers.append(Quoted(f"{key}.max", where, "hand's height, largest error", most, "m"))
    for name, (middle, spread) in (("roll", roll), ("pitch", pitch), ("yaw", yaw)):
        numbers.append(Quoted(f"{key}.{name}", where, f"hand's {name}, mean", middle, "rad"))
        numbers.append(
            Quoted(f"{key}.{name}_std", where, f"hand's {name}, standard deviation", spread, "rad")
        )
    return tuple(numbers)


PAPER_B = (
    Quoted("omni.speed", "Paper B, Unified Model", "speeds that it mainly drives at, below", 2.0, "m/s"),
    # Formulation of Motion Control: computing times.
    Quoted("omni.states", _TIMES, "state variables of the optimal control problem", 41, "states"),
    Quoted("omni.nodes_cold", _TIMES, "time steps of the cold start", 160, "steps"),
    Quoted("omni.precision", _TIMES, "precision of convergence", 1e-4, "1"),
    Quoted("omni.cold_least", _TIMES, "time of a cold start, from", 130.0, "ms"),
    Quoted("omni.cold_most", _TIMES, "time of a cold start, to", 170.0, "ms"),
    Quoted("omni.nodes_warm", _TIMES, "time steps during execution", 20, "steps"),
    Quoted("omni.warm_least", _TIMES, "time of a warm start during execution, from", 11.0, "ms"),
    Quoted("omni.warm_most", _TIMES, "time of a warm start during execution, to", 13.0, "ms"),
    Quoted("omni.stable_least", _TIMES, "time of a warm start in stable phases, from", 3.0, "ms"),
    Quoted("omni.stable_most", _TIMES, "time of a warm start in stable phases, to", 4.0, "ms"),
    Quoted("omni.feedback", _TIMES, "rate of the linear feedback", 500.0, "Hz"),
    Quoted(
        *("omni.orin", _TIMES, "computed on an Nvidia Jetson Orin NX"),
        unused="ours are times of the machine named above",
    ),
    # Results: the robot.
    Quoted("omni.leg_joints", _PLATFORM, "leg joints", 8, "joints"),
    Quoted("omni.steering_joints", _PLATFORM, "steering joints", 4, "joints"),
    Quoted("omni.wheel_joints", _PLATFORM, "wheel-driving joints", 4, "joints"),
    Quoted("omni.arm_joints", _PLATFORM, "degrees of freedom of the arm with its gripper", 7, "joints"),
    # Simulation.
    Quoted("omni.length", _SIX, "length of the wave-shaped ground", 11.5, "m"),
    Quoted("omni.peak", _SIX, "peak height of the waves", 0.2, "m"),
    Quoted("omni.height", _SIX, "hand's target height", 0.92, "m"),
    Quoted("omni.roll", _SIX, "hand's target roll", -1.57, "rad"),
    Quoted("omni.pitch", _SIX, "hand's target pitch", 0.0, "rad"),
    Quoted("omni.yaw", _SIX, "hand's target yaw", -1.57, "rad"),
    Quoted("omni.pitch_shift", _SIX, "shift of the pitch in figures", -1.57, "rad"),
    Quoted("waves.ik_mean", _SIX, "hand's height, mean, inverse kinematics", 0.928, "m"),
    Quoted("waves.ik_std", _SIX, "hand's height, standard deviation, inverse kinematics", 0.041, "m"),
    Quoted("waves.ik_max", _SIX, "hand's height, largest error, inverse kinematics", 0.083, "m"),
    *_hand("waves", _SIX, (0.924, 0.008, 0.007), (-1.578, 0.009), (-1.580, 0.05), (-1.575, 0.08)),
    Quoted("waves.calmer", _SIX, "the whole-body controller lets the hand oscillate less than the arm alone"),
    *_hand("fixed", _FIXED, (0.919, 0.005, 0.018), (-1.597, 0.016), (-1.561, 0.003), (-1.545, 0.016)),
    Quoted("fixed.legs", _FIXED, "ends of all legs shift forward or backward"),
    Quoted("fixed.joints", _FIXED, "joints deviate significantly to keep the base stable"),
    *_hand("combined", _MODES, (0.916, 0.002, 0.011), (-1.594, 0.033), (-1.573, 0.009), (-1.551, 0.057)),
    # Experiments, on hardware.
    Quoted("turn.angle", _TURN, "angle of the rotation in place", 1.8, "rad"),
    Quoted("turn.returns", _TURN, "returns to the initial orientation"),
    Quoted("turn.height", _TURN, "the hand's height remains nearly constant"),
    Quoted("turn.drift", _TURN, "minor horizontal drifts of the hand"),
    Quoted("turn.yaw", _TURN, "in the base's axes the hand's yaw rotates and recovers"),
    Quoted("turn.legs", _TURN, "legs work in coordination to stabilize the body"),
    Quoted("turn.limit", _TURN, "the arm runs into a hard joint limit"),
    Quoted(
        *("turn.target", _TURN, "hand's target orientation of (1.57, 0, 0) rad"),
        unused="in axes that are not given; here it is that of the simulations",
    ),
    Quoted(
        *("turn.oscillates", _TURN, "oscillations around 10 to 12 s and 15 to 17 s"),
        unused="of the hardware's estimation and joint limits",
    ),
    Quoted(
        *("turn.sawtooth", _TURN, "sawtooth-like oscillations of sensor readings"),
        unused="of the hardware's sensors",
    ),
    Quoted("squat.hand", _SQUAT, "the hand remains stable while the robot squats and stands up"),
)
"""*Whole-body Motion Control of an Omnidirectional Wheel-Legged Mobile Manipulator via Contact-Aware Dynamic
Optimization*, in reading order. Pitch is as printed, with the shift of the figures."""

_BY_KEY = {quoted.key: quoted for quoted in PAPER_A + PAPER_B}


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
