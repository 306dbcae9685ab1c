"""What the report says: pure functions from evidence to blocks. They select and word; they compute nothing."""
