"""Sweeps: tables of scenes, simulated in parallel and measured, as one data frame."""
