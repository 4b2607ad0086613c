"""Runs of experiments, one or many: prepare, loop, measure."""
