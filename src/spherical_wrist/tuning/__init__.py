"""Gains found by search: small errors against little chattering, over a family of perturbed wrists."""
