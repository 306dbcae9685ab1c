"""Worker processes, and the cores and memory of this machine."""
