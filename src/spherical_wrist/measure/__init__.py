"""Measurement: from the log of the loop to the series of a run and its metrics."""
