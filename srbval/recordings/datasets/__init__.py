"""Known data sets: their descriptions (data) and the recognisers that apply them to a file."""
