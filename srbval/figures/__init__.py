"""Figures of plain arrays: their one style, what draws a record, and the files they are written to."""
