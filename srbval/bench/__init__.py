"""Speed against accuracy: the cost of a solver on the paper's scenes, and its errors there."""
