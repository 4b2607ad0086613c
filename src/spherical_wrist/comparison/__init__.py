"""Comparison of laws: on a suite of cases, and by the deviation from the nominal wrist at which each misses a bound.

Importing this package imports no module of it, so that ``wrist list`` need not wait for MuJoCo.
"""
