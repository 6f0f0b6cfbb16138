"""Diagnosis: what a model gets wrong, the cause by name, the extended model, and how it is inverted."""
