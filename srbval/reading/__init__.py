"""Reads the fault lines of a recording: band, envelope spectrum, shaft speed, frequencies with 95 % intervals."""
