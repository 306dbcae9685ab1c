"""Campaigns: many cases from one file, on a laptop or a cluster, each result kept as soon as it is there."""
