"""Speed against accuracy: what a solver costs on the paper's scenes, and how wrong it is there."""
