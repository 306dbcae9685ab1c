"""The study second comb."""
