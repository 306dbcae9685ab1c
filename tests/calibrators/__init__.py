"""Programs for developers: they recompute the constants of `srbval.signal`, or measure what a campaign costs."""
