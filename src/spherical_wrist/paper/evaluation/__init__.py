"""Evaluation of the source paper, regenerated: its table, its figures, and a verdict on each of its claims."""
