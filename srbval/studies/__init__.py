"""Studies that srbval carries, one folder each: how it is computed, its page in the report, its texts."""
