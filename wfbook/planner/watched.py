"""SCIP as CVXPY calls it, watched: where the search of the paper's own program stands."""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
from cvxpy.reductions.solvers.conic_solvers.scip_conif import SCIP

from wfbook.planner.tree import Progress

_SHOWN = 0.1  # seconds between two reports, at least


class Watched(SCIP):
    """CVXPY's interface to SCIP, telling its progress.

    Attributes:
        error: what the progress callback raised; it ended the search.
    """

    def __init__(self, progress: Callable[[Progress], None] | None, offset: float):
        """Begin.

        Args:
            progress: called with where the search stands, ten times a second at most.
            offset: the objective's constant, which the solver does not see.
        """
        super().__init__()
        self.error: BaseException | None = None
        self._progress, self._offset, self._over = progress, offset, False
        self._begin, self._shown = time.perf_counter(), -np.inf

    def _set_params(self, model: Any, *arguments: Any) -> None:
        """Set parameters as CVXPY does, and ask to be told of nodes, relaxations and solutions."""
        super()._set_params(model, *arguments)
        if self._progress is not None:
            from pyscipopt import SCIP_EVENTTYPE

            events = ["NODESOLVED", "LPSOLVED", "ROWADDEDSEPA", "BESTSOLFOUND", "DUALBOUNDIMPROVED"]
            model.attachEventHandlerCallback(self._told, [getattr(SCIP_EVENTTYPE, name) for name in events])

    def _solve(self, *arguments: Any) -> dict[str, Any]:
        """Solve as CVXPY does. SCIP has events even while it is taken down: then nobody listens."""
        try:
            return super()._solve(*arguments)
        finally:
            self._over = True

    def _told(self, model: Any, event: Any) -> None:
        """Report; SCIP would print and lose an exception, so it is kept."""
        elapsed = time.perf_counter() - self._begin
        if self._over or self.error is not None or elapsed - self._shown < _SHOWN:
            return
        self._shown = elapsed
        try:
            self._progress(self.stands(model))
        except BaseException as error:
            self.error = error
            model.interruptSolve()

    def stands(self, model: Any) -> Progress:
        """Return where the search stands; nothing can cost less than zero."""
        found = model.getNSols() > 0 and not model.isInfinity(model.getPrimalbound())
        incumbent = model.getPrimalbound() + self._offset if found else np.inf
        bound = min(max(model.getDualbound() + self._offset, 0.0), incumbent)
        gap = (incumbent - bound) / incumbent if found else np.inf
        elapsed = time.perf_counter() - self._begin
        return Progress(int(model.getNTotalNodes()), incumbent, bound, gap, elapsed)
