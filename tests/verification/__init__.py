"""Verification: does the full model solve the equations it states? Each check against something independent of it.

Checks compare with closed forms, conservation laws, symmetries and a second formulation in world axes; none compares
with a measurement. `test_planted_errors.py` shows that a wrong sign in a force or inertia term makes some check fail.
"""
