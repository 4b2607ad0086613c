"""Formats of exports; the endings of their names say which."""

EXPORTS = (".csv", ".parquet", ".npz")
