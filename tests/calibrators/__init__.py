"""Programs for developers that compute the constants of `srbval.signal` anew; each prints its table."""
