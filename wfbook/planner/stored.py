"""Plans that take longer to find than a reader waits, under ``assets/plans/``.

``python assets/plans/build.py NAME`` makes one again; ``assets/README.md`` lists them.
"""

from pathlib import Path

from wfbook.planner.plan import Plan

PLANS = Path(__file__).parent.parent.parent / "assets" / "plans"


def names() -> list[str]:
    """Return the names of the plans that are stored."""
    return sorted(path.stem for path in PLANS.glob("*.npz") if not path.stem.endswith("_relaxed"))


def stored(name: str, relaxed: bool = False) -> Plan:
    """Return a stored plan.

    Args:
        name: one of :func:`names`, for example ``"ramp-down"``.
        relaxed: the mixed-integer optimum itself instead of its polished form.

    Raises:
        ValueError: there is no plan of that name.

    Example:
        >>> from wfbook.planner import stored
        >>> plan = stored("flat")
        >>> plan.slots, plan.terrain.name, bool(plan.distance > 0.9)
        (10, 'flat', True)
    """
    if name not in names():
        raise ValueError(f"name {name!r} is none of the stored plans {', '.join(names())}")
    return Plan.load(PLANS / f"{name}{'_relaxed' if relaxed else ''}.npz")
