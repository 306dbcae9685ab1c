"""The study rig inputs."""
