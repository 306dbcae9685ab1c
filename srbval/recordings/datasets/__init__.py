"""Interpretation of the variables of a file: files of srbval, of known data sets, and others."""
