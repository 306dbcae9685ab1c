"""Any model against any rig: the validation case, its pairs, their comparison, and the report of a case."""
