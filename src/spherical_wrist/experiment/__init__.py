"""Experiments, the runs that come out of them, and their recordings."""
