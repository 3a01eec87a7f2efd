"""The papers' figures and numbers beside what was reproduced: ``python -m wfbook paper``.

Part I is paper A, section IV: gaits on five terrains (Figs. 8 to 12), speed (Fig. 13), cost of transport
and Table II. Part II is paper B: the hand over waves (Fig. 6) and on level ground (Fig. 7), what its hardware
does (Figs. 8 to 10), and computing times. What the papers say is in :mod:`wfbook.quoted`; all else is
computed here from plans and runs. Where a paper leaves a condition open (goal, weights, friction, the longest
step of IV-B, the number of waves) ours is in the settings of the experiment, and no weight or gain is changed
from one experiment to the next.

In reading order: :mod:`.options` is what may be asked, :mod:`.record` is a line of the comparison.
:mod:`.store` keeps plans and runs, so that an interrupted command goes on where it was; :mod:`.bench` plans
and simulates. :mod:`.reading` reads gaits; :mod:`.gaits`, :mod:`.speed`, :mod:`.transport` and :mod:`.times`
are the experiments of part I. :mod:`.drives` is what is kept of a run of part II; :mod:`.waves`,
:mod:`.level`, :mod:`.hardware` and :mod:`.solving` are its experiments. :mod:`.parts` lists all.
:mod:`.text` prints, :mod:`.command` is the command.
"""
