"""Content of the source paper that the rest of the package does not need.

Wrist dynamics in angles, Denavit–Hartenberg kinematics and their inverse, Lyapunov's argument along a run
(:mod:`~spherical_wrist.paper.lyapunov`), and the evaluation with its table, figures and claims
(:mod:`~spherical_wrist.paper.evaluation`).
"""
