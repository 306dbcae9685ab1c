"""Diagnosis of a bearing from the lines of a record: comparison with a healthy record, fault probabilities, verdict."""
