"""Sweeps: simulate every scene of a table in parallel, and collect measures of the runs in a data frame."""
