"""Experiments: descriptions of runs, validated and frozen, as Python, TOML or a command."""
