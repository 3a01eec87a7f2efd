"""Gaits a roboticist would try first, and small changes to a gait: the search's primal heuristics."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from wfbook.planner.gait import UNKNOWN, Gait
from wfbook.planner.kernel import Kernel
from wfbook.planner.problem import Problem
from wfbook.planner.symmetry import MIRROR, mirror_symmetric

TROT = ((0, 3), (1, 2))
CRAWL = ((2,), (0,), (3,), (1,))

_EXACT = 2  # gaits solved exactly at once
_SEVERAL = 6  # of them in a round of the local search, where the choice of regions may lead nowhere
_TEMPLATES = 16  # templates that may be tried before one is feasible
_ROUNDS = 10
_DIVES = 400  # relaxations that a dive may take
_BATCH = 8  # gaits bounded between two looks at the clock


def templates(problem: Problem) -> Iterator[Gait]:
    """Yield common gaits, their regions left open.

    Trots and crawls of several lengths, from either side; with wheels also trots in which some legs
    land on wheels at their first swing and then roll, and all of them on wheels but for one that puts a
    foot down to stop.
    """
    L, J = problem.legs, problem.slots
    last = J - 1 if problem.final_stance else J
    feet = np.array([[int(e == "wheel")] * J for e in problem.start_end_effectors])
    lengths = sorted({last - i for i in (0, 1, 2, 3, last // 2)} & set(range(1, last + 1)))
    yield _open(np.zeros((L, J), int), feet)
    for cycle in (TROT, TROT[::-1], CRAWL, CRAWL[1:] + CRAWL[:1]):
        for swings in lengths:
            S = np.zeros((L, J), int)
            for j in range(swings):
                S[list(cycle[j % len(cycle)]), j] = 1
            yield _open(S, feet)
    if not problem.wheels:
        return
    for rolling in range(1, 2**L):
        roll = [leg for leg in range(L) if rolling >> leg & 1]
        for pairs in (TROT, TROT[::-1]):
            for steps in sorted({min(n, last) for n in (2, 4, 8)}):
                S, wheel = np.zeros((L, J), int), feet.copy()
                for j in range(steps):
                    for leg in pairs[j % 2]:
                        if leg not in roll or not S[leg].any():
                            S[leg, j] = 1
                            wheel[leg, j:] = leg in roll
                yield _open(S, wheel)
                if len(roll) == L and steps == min(2, last):
                    for leg in (0, 2):
                        for j in {last - 1, (last + steps) // 2}:
                            stop, braked = S.copy(), wheel.copy()
                            stop[leg, j], braked[leg, j:] = 1, 0
                            yield _open(stop, braked)


def neighbours(problem: Problem, gait: Gait) -> Iterator[Gait]:
    """Yield gaits one small change away: drop, shift or add a swing, change what it lands on.

    Their regions are open.
    """
    S, wheel, _ = gait
    L, J = S.shape
    landed = [[(j, wheel[leg, j]) for j in np.flatnonzero(S[leg])] for leg in range(L)]
    for leg in range(L):
        for i, (j, kind) in enumerate(landed[leg]):
            rest = landed[leg][:i] + landed[leg][i + 1 :]
            yield _with(problem, gait, leg, rest)
            for other in (j - 1, j + 1):
                if 0 <= other < J and other not in [s for s, _ in rest]:
                    yield _with(problem, gait, leg, sorted([*rest, (other, kind)]))
            if problem.wheels:
                yield _with(problem, gait, leg, sorted([*rest, (j, 1 - kind)]))
    for leg, j in np.argwhere((S == 0) & (wheel == 1)) if _rolling_slows(problem) else ():
        # A push: down on the foot, and two slots later on the wheel again.
        if j + 2 < J and not S[leg, j : j + 3].any():
            yield _with(problem, gait, leg, sorted([*landed[leg], (j, 0), (j + 2, 1)]))
    if problem.ground.count > 1:  # another step, where one is too short for the ground
        for leg, j in np.argwhere(S == 0):
            near = S[leg, max(j - 1, 0) : j + 2].any() and problem.stance_between_swings
            if not near and not (j == J - 1 and problem.final_stance):
                yield _with(problem, gait, leg, sorted([*landed[leg], (j, wheel[leg, j])]))
    for pair in ((0, 3), (1, 2)):
        for j in range(J):
            if S[pair[0], j] and S[pair[1], j]:
                changed = gait
                for leg in pair:
                    rest = [s for s in landed[leg] if s[0] != j]
                    changed = _with(problem, changed, leg, rest)
                yield changed


def _rolling_slows(problem: Problem) -> bool:
    """Tell whether wheels lose speed, so that it is worth a swing to push."""
    ground = problem.ground
    return ground.level is None or any(s.rolling_resistance > 0 for s in ground.surfaces)


def _with(problem: Problem, gait: Gait, leg: int, landings: list) -> Gait:
    """Return the gait with one leg's swings replaced by ``(slot, end effector)`` pairs."""
    S, wheel = gait.S.copy(), gait.wheel.copy()
    S[leg] = 0
    wheel[leg] = problem.start_end_effectors[leg] == "wheel"
    for j, kind in landings:
        S[leg, j] = 1
        wheel[leg, j:] = kind
    return _open(S, wheel)


def _open(S: np.ndarray, wheel: np.ndarray) -> Gait:
    return Gait(S, wheel, np.full_like(S, UNKNOWN))


def improve(
    kernel: Kernel, stop: Callable[[], bool] = lambda: False, known: Sequence[Gait] = ()
) -> Iterator[tuple[float, Gait]]:
    """Yield ever better gaits: the best templates by the QP, solved exactly, then changed bit by bit.

    Args:
        kernel: bounds and leaves of the problem.
        stop: asked now and then; once true, nothing more is tried.
        known: gaits to try before all others, such as the rest of an earlier plan.

    Yields:
        Cost and gait, each better than the one before.
    """
    problem, seen = kernel.problem, set()
    mirror = list(MIRROR) if mirror_symmetric(problem) else None

    def ranked(gaits: Iterable[Gait], below: float) -> list[Gait]:
        """Return the gaits not seen before whose QP bound is below a value, the lowest first."""
        fresh = []
        for gait in gaits:
            images = [gait] + ([Gait(*(part[mirror] for part in gait))] if mirror else [])
            keys = {image.modes for image in images}
            if not (keys & seen) and kernel.boxes.of_modes(gait) is not None:
                seen.update(keys)
                fresh.append(gait)
        bounds: list[float] = []
        for i in range(0, len(fresh), _BATCH):
            if stop():
                break
            # Only the best few are wanted.
            worth = min(below, sorted(bounds)[_EXACT - 1] if len(bounds) >= _EXACT else np.inf)
            bounds += kernel.gait_bounds(fresh[i : i + _BATCH], worth)
        order = sorted(range(len(bounds)), key=lambda i: (bounds[i], i))
        return [fresh[i] for i in order if bounds[i] < below]

    def first_below(gaits: list[Gait], below: float) -> tuple[float, Gait | None]:
        """Return the cheapest of the first few gaits, regions open, that cost less; None if none does."""
        for i in range(0, len(gaits), _EXACT):
            if stop():
                break
            tried = [gait for gait in kernel.complete(gaits[i : i + _EXACT]) if gait is not None]
            costs = kernel.price(tried, below, quick=True)
            if min(costs, default=np.inf) < below:
                return min(costs), tried[int(np.argmin(costs))]
        return np.inf, None

    costs = kernel.price(begin := [gait for gait in known if kernel.boxes.admissible(gait)], quick=True)
    best, current = min(costs, default=np.inf), None
    if np.isfinite(best):
        current = begin[int(np.argmin(costs))]
        yield best, current
    # Where common gaits miss the ground, that of the lowest bound is seldom the first to find it.
    many = _EXACT if problem.ground.count == 1 else _SEVERAL
    tries = _TEMPLATES if current is None else many
    cost, found = first_below(ranked(templates(problem), best)[:tries], best)
    if found is None and current is None and not stop():
        found = next(dive(kernel, stop), None)
        cost = kernel.price([found], quick=True)[0] if found else np.inf
    for _ in range(_ROUNDS):
        if found is not None:
            best, current = cost, found
            yield best, current
        elif current is None:
            return
        if stop():
            return
        cost, found = first_below(ranked(neighbours(problem, current), best)[:many], best)
        if found is None:
            return


def dive(kernel: Kernel, stop: Callable[[], bool] = lambda: False) -> Iterator[Gait]:
    """Yield a first gait that the relaxation leads to: slot by slot, each decision as it would have it.

    Where a decision turns out impossible, the other way is taken: a depth-first search that spends no more
    than a number of relaxations. It finds plans where common gaits miss the ground.

    Args:
        kernel: bounds of the problem.
        stop: asked now and then; once true, nothing more is tried.
    """
    boxes, layout = kernel.boxes, kernel.boxes.layout
    slots = np.full(layout.size, np.iinfo(int).max)
    # Within a slot: who swings, then what it lands on, then where.
    for rank, index in enumerate((layout.S, layout.wheel, layout.G)):
        slots[index] = 3 * np.arange(kernel.problem.slots) + rank
    stack = [box for box in [boxes.root()] if box is not None]
    for _ in range(_DIVES):
        if not stack or stop():
            return
        box = stack.pop()
        found = kernel.bound(*box)
        if found.status == "infeasible":
            continue
        if (box[0] == box[1]).all():
            gait = boxes.gait(box[0])
            if np.isfinite(kernel.price([gait], quick=True)[0]):
                yield gait
                return
            continue
        z = found.y if found.status == "solved" else 0.5 * (box[0] + box[1])
        open_ = np.flatnonzero((box[0] < box[1]) & (slots < np.iinfo(int).max))
        if not len(open_):  # sums follow from what they sum
            continue
        first = open_[slots[open_] == slots[open_].min()]
        index = first[np.argmax(np.abs(z[first] - 0.5))]
        wanted = int(np.clip(np.rint(z[index]), box[0][index], box[1][index]))
        for value in (1 - wanted, wanted):
            lower, upper = box[0].copy(), box[1].copy()
            lower[index] = upper[index] = value
            child = boxes.propagate(lower, upper)
            if child is not None:
                stack.append(child)
