"""Preparation of a run: from an experiment to models, sampled inputs and a compiled law."""
