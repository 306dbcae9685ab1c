"""Storage: files written completely or not at all, strict JSON and TOML, HDF5 with checksums, stored results."""
