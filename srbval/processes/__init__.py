"""Worker processes, which may hang, crash or be killed at any moment; what this process may use of the machine."""
