"""A planar ring on kinematic rollers: two free coordinates, contact stiffness varying as the rollers pass.

Answers: harmonic pattern, load-zone modulation and sidebands, amplitude, roller passage (variable compliance) of a
healthy bearing. Cannot answer: slip (its cage turns kinematically), noise floor (nothing rattles or chatters), axial
load or motion, point passing, energy, roller dynamics.
"""
