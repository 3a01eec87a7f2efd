"""Gaits a roboticist would try first, and small changes to a gait: the search's primal heuristics."""

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from wfbook.planner.boxes import gait_key
from wfbook.planner.kernel import Kernel
from wfbook.planner.problem import Problem
from wfbook.planner.symmetry import MIRROR, mirror_symmetric

TROT = ((0, 3), (1, 2))
CRAWL = ((2,), (0,), (3,), (1,))

_EXACT = 2  # gaits solved exactly in each round of the local search
_ROUNDS = 6
_BATCH = 8  # gaits bounded between two looks at the clock

Gait = tuple[np.ndarray, np.ndarray]


def templates(problem: Problem) -> Iterator[Gait]:
    """Yield swing matrices and wheel's dynamics matrices of common gaits.

    Trots and crawls of several lengths, from either side; with wheels also trots in which some legs
    land on wheels at their first swing and then roll, and all of them on wheels but for one that puts a
    foot down to stop.
    """
    L, J = problem.legs, problem.slots
    last = J - 1 if problem.final_stance else J
    feet = np.array([[int(e == "wheel")] * J for e in problem.start_end_effectors])
    lengths = sorted({last - i for i in (0, 1, 2, 3, last // 2)} & set(range(1, last + 1)))
    yield np.zeros((L, J), int), feet
    for cycle in (TROT, TROT[::-1], CRAWL, CRAWL[1:] + CRAWL[:1]):
        for swings in lengths:
            S = np.zeros((L, J), int)
            for j in range(swings):
                S[list(cycle[j % len(cycle)]), j] = 1
            yield S, feet
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
                yield S, wheel
                if len(roll) == L and steps == min(2, last):
                    for leg in (0, 2):
                        for j in {last - 1, (last + steps) // 2}:
                            stop, braked = S.copy(), wheel.copy()
                            stop[leg, j], braked[leg, j:] = 1, 0
                            yield stop, braked


def neighbours(problem: Problem, S: np.ndarray, wheel: np.ndarray) -> Iterator[Gait]:
    """Yield gaits one small change away: drop or shift a swing, change what a leg lands on."""
    L, J = S.shape
    landed = [[(j, wheel[leg, j]) for j in np.flatnonzero(S[leg])] for leg in range(L)]
    for leg in range(L):
        for i, (j, kind) in enumerate(landed[leg]):
            rest = landed[leg][:i] + landed[leg][i + 1 :]
            yield _with(problem, S, wheel, leg, rest)
            for other in (j - 1, j + 1):
                if 0 <= other < J and other not in [s for s, _ in rest]:
                    yield _with(problem, S, wheel, leg, sorted([*rest, (other, kind)]))
            if problem.wheels:
                yield _with(problem, S, wheel, leg, sorted([*rest, (j, 1 - kind)]))
    for pair in ((0, 3), (1, 2)):
        for j in range(J):
            if S[pair[0], j] and S[pair[1], j]:
                dropped, kinds = S, wheel
                for leg in pair:
                    rest = [s for s in landed[leg] if s[0] != j]
                    dropped, kinds = _with(problem, dropped, kinds, leg, rest)
                yield dropped, kinds


def _with(problem: Problem, S: np.ndarray, wheel: np.ndarray, leg: int, landings: list) -> Gait:
    """Return the gait with one leg's swings replaced by ``(slot, end effector)`` pairs."""
    S, wheel = S.copy(), wheel.copy()
    S[leg] = 0
    wheel[leg] = problem.start_end_effectors[leg] == "wheel"
    for j, kind in landings:
        S[leg, j] = 1
        wheel[leg, j:] = kind
    return S, wheel


def mirrored(gait: Gait) -> Gait:
    """Return a gait with left and right exchanged."""
    return gait[0][list(MIRROR)], gait[1][list(MIRROR)]


def improve(
    kernel: Kernel, stop: Callable[[], bool] = lambda: False, known: Sequence[Gait] = ()
) -> Iterator[tuple[float, np.ndarray, np.ndarray]]:
    """Yield ever better gaits: the best templates by the QP, solved exactly, then changed bit by bit.

    Args:
        kernel: bounds and leaves of the problem.
        stop: asked now and then; once true, nothing more is tried.
        known: gaits to try before all others, such as the rest of an earlier plan.

    Yields:
        Cost, swing matrix and wheel's dynamics matrix, each better than the one before.
    """
    problem, seen = kernel.problem, set()
    symmetric = mirror_symmetric(problem)

    def ranked(gaits: Iterable[Gait], below: float) -> list[Gait]:
        """Return the gaits not seen before whose QP bound is below a value, the lowest first."""
        fresh = []
        for gait in gaits:
            keys = {gait_key(*gait)} | ({gait_key(*mirrored(gait))} if symmetric else set())
            if not (keys & seen) and kernel.boxes.admissible(*gait):
                seen.update(keys)
                fresh.append(gait)
        bounds: list[float] = []
        for i in range(0, len(fresh), _BATCH):
            if stop():
                break
            bounds += kernel.gait_bounds(fresh[i : i + _BATCH])
        order = sorted(range(len(bounds)), key=lambda i: (bounds[i], i))
        return [fresh[i] for i in order if bounds[i] < below]

    best, current = np.inf, None
    for turn in range(_ROUNDS + 1):
        if turn == 0:
            tried = [gait for gait in known if kernel.boxes.admissible(*gait)]
        else:
            gaits = templates(problem) if turn == 1 else neighbours(problem, *current)
            tried = ranked(gaits, best)[:_EXACT]
        costs = [c if c < np.inf else np.inf for c in kernel.price(tried)]  # NaN is no answer
        if costs and min(costs) < best:
            best, current = min(costs), tried[int(np.argmin(costs))]
            yield best, *current
        elif turn > 1 or (turn == 1 and current is None):
            return
        if stop():
            return
