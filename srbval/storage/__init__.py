"""Files: written whole or not at all, strict JSON, this program's own HDF5 layout."""
