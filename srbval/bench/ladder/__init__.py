"""The ladder of models against the full one: what each question's answer is off by on each rung, and what it costs."""
