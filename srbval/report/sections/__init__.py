"""Sections of the report: pure functions from findings to blocks, which select and word and compute nothing."""
