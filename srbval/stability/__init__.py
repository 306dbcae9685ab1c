"""Where each method of time integration fails, by solver, step and speed, and the limit that linear theory predicts."""
