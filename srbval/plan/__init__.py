"""Choice of the cheapest model that answers a question on a scene, from stored errors against a reference model."""
