"""From lines to a fault: comparison with a healthy baseline, probabilities of each fault."""
