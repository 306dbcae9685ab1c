"""Programs for developers: they compute the constants of `srbval.signal` anew, or measure what a campaign costs."""
