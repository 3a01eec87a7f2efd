"""The papers' figures and numbers beside what was reproduced: ``python -m wfbook paper``.

Part I is paper A, section IV: gaits on five terrains (Figs. 8 to 12), speed (Fig. 13), cost of transport
and Table II. What the papers say is in :mod:`wfbook.quoted`; all else is computed here from plans and runs.
Where the paper leaves a condition open (goal, weights, friction, the longest step of IV-B) ours is in the
settings of the experiment, and no weight or gain is changed from one experiment to the next.

In reading order: :mod:`.options` is what may be asked, :mod:`.record` is a line of the comparison.
:mod:`.store` keeps plans and runs, so that an interrupted command goes on where it was; :mod:`.bench` plans
and simulates. :mod:`.reading` reads gaits; :mod:`.gaits`, :mod:`.speed`, :mod:`.transport` and :mod:`.times`
are the experiments, :mod:`.parts` lists them. :mod:`.text` prints, :mod:`.command` is the command.
"""
