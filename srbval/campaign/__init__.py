"""Campaigns: many simulations defined in one file, run on this machine or a cluster; each result is stored at once."""
