"""Regression of the program's behaviour: a fingerprint, its comparison with the reference, and stale evidence."""
