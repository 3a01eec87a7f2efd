"""Part II: the omnidirectional wheel-legged manipulator of paper B.

In reading order: :mod:`.robot` is the robot in MuJoCo and in Pinocchio; :mod:`.wheels` is chapter 9, how four
steered wheels move a body, and :mod:`.base` what
their motors let it do.
"""
