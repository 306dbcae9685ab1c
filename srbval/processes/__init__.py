"""Child processes that answer requests and can be killed at any moment: work that may hang, crash or take too much."""
