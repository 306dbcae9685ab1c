"""The ladder of models compared with the full one: error of each question's answer on each rung, and its cost."""
