"""Part II: the omnidirectional wheel-legged manipulator of paper B.

In reading order: :mod:`.robot` is the robot in MuJoCo and in Pinocchio. Chapter 9: :mod:`.wheels` is how
four steered wheels move a body, :mod:`.base` what their motors let it do, and :mod:`.driving` the robot
that does it.
"""
