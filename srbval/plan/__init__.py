"""Choice of the cheapest model that answers a question on a scene; the errors of all models were measured before."""
