"""Campaigns: one experiment under many conditions, from a single run to a million, on threads, cores and clusters."""
