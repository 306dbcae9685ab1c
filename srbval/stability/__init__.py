"""Where each method of time integration fails: solver by step by speed, and the limit that linear theory predicts."""
