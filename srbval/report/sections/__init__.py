"""What the report says: pure functions from findings to blocks. They select and word; they compute nothing."""
