"""Old names of `tables`."""

from srbval.storage.tables import build, quantity, read_toml

__all__ = ["build", "quantity", "read_toml"]
