"""Run as Rerun recordings: written whole or not at all, and read back bit for bit.

Importing this package imports no module of it: Rerun's SDK takes half a second.
"""
