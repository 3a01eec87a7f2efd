"""How much a plan, its controller and its estimator bear: many seeded simulations, disturbed one way or two.

A *case* is one simulation: a plan, a value for each of :data:`.axes.AXES` and a seed. It has its result in
itself, so cases may run anywhere, in any order, and again. A *study* is a set of cases: sweeps change one
factor, grids two, all others stay as the base has them. What is not given of a push, its direction and its
moment, is drawn from the seed: the same for every strength, so that levels are compared on equal pushes.

In reading order: :mod:`.axes` says what can be disturbed, :mod:`.ground` builds ground that is not as the
plan thinks, :mod:`.case` runs one case, :mod:`.design` says which cases a study has, :mod:`.store` keeps
what is finished, :mod:`.cluster` runs cases through Dask, :mod:`.tables` makes the Parquet file and the
summary, :mod:`.text` prints that, :mod:`.plans` brings the plans, :mod:`.command` is
``python -m wfbook study``; :mod:`.here` runs a handful of cases without any of that.
"""
