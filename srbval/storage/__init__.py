"""Files: written whole or not at all, strict JSON and TOML, HDF5 with checksums; results with what they depend on."""
