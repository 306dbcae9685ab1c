"""Engines: where the cases of a campaign run, behind one interface."""
