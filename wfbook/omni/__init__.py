"""Part II: the omnidirectional wheel-legged manipulator of paper B.

In reading order: :mod:`.robot` is the robot in MuJoCo and in Pinocchio. Chapter 9: :mod:`.wheels` is how
four steered wheels move a body, :mod:`.base` what their motors let it do, and :mod:`.driving` the robot
that does it. Chapter 10: :mod:`.wrench` is what one contact can do, :mod:`.support` what all of them can,
:mod:`.dynamics` how the robot accelerates on them, and :mod:`.tipping` the robot pushed over. Chapter 11:
:mod:`.bellman` is the value function on a grid and :mod:`.ddp` the method in plain NumPy, for the
:mod:`.systems` that they are shown on; for the robot itself :mod:`.locked` has its 41 states, :mod:`.costs`
the terms of the cost, and :mod:`.problem` the optimal control problem in Crocoddyl, with contacts of
:mod:`.touching`; :mod:`.tasks` asks it things. Chapter 12: :mod:`.waves` is the terrain, :mod:`.rolling`
keeps the wheels to a commanded base, :mod:`.controller` is whole-body control and what paper B compares
itself with, and :mod:`.habits` what can be left out of it. For legged mode :mod:`.stride` and :mod:`.jump`
say what is asked of steps and jumps, :mod:`.motion` plans them, and :mod:`.on_legs` follows the plan;
:mod:`.machine` changes between the modes and :mod:`.two_modes` carries out tasks. :mod:`.simulate`
simulates, with :mod:`.noise`; :mod:`.runs` is what is left of it, :mod:`.merits` what is measured of that,
:mod:`.scenarios` the paper's experiments by name, and :mod:`.legged` those that need legs.
"""
