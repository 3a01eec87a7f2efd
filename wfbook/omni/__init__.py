"""Part II: the omnidirectional wheel-legged manipulator of paper B.

In reading order: :mod:`.robot` is the robot in MuJoCo and in Pinocchio. Chapter 9: :mod:`.wheels` is how
four steered wheels move a body, :mod:`.base` what their motors let it do, and :mod:`.driving` the robot
that does it. Chapter 10: :mod:`.wrench` is what one contact can do, :mod:`.support` what all of them can,
:mod:`.dynamics` how the robot accelerates on them, and :mod:`.tipping` the robot pushed over. Chapter 11:
:mod:`.ddp` is the method in plain NumPy, for the :mod:`.systems` that it is shown on; for the robot itself
:mod:`.locked` has its 41 states, :mod:`.costs` the terms of the cost, and :mod:`.problem` the optimal
control problem in Crocoddyl. Chapter 12: :mod:`.waves` is the terrain, :mod:`.rolling` keeps the wheels to a
commanded base, :mod:`.controller` is whole-body control and what paper B compares itself with, and
:mod:`.habits` what can be left out of it. For legged mode :mod:`.stride` and :mod:`.jump` say what is asked
of steps and jumps, :mod:`.motion` plans them, and :mod:`.on_legs` follows the plan; :mod:`.machine` changes
between the modes and :mod:`.two_modes` carries out tasks. :mod:`.simulate` has the runs, :mod:`.merits` what
is measured of them, :mod:`.scenarios` the paper's experiments by name, and :mod:`.legged` those that need
legs.
"""
