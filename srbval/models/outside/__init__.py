"""Models from outside the package: a Python function of a scene, a program, or an FMU, each in a process of its own."""
