"""Kinematics only: a click whenever a rolling element of a purely rolling bearing passes a defect.

Answers: where the fault lines are, but for slip. Cannot answer anything about heights: its clicks are all alike, of
one sample and no particular strength, so harmonics, sidebands, noise floor and amplitude mean nothing; nor slip, which
it takes to be none. A healthy bearing is silent. Needs no geometry: orders are enough.
"""
