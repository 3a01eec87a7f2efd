"""Paper A's Table II on this machine: how long the search for a proven optimum takes.

Each row is searched by the tight formulation, and by the paper's own on plain SCIP with a time cap, beside
the time that the paper reports for Gurobi 12 on a Core Ultra 7. Those times are the only numbers here that
are not measured. The paper names neither weights nor limits, so its instances can only be approached: goal
0.1 m ahead for each slot, 12 degrees for the ramp.

The table's caption says "without friction or multi-region constraint". Here wheels may roll from one region
of the ramp to the next, which is harder; the last row is the same ramp with every region a group of its own,
so that they can't: the paper's condition.

In reading order: :mod:`.trial` solves one problem in a process of its own, :mod:`.benchmark` says which
problems, :mod:`.text` prints what was found, :mod:`.command` is ``python -m wfbook table2``.
"""
