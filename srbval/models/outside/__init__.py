"""Models from outside the package, each in a separate process: a Python function, a program, or an FMU."""
