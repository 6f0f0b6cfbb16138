"""Diagnosis: what a model gets wrong and why, by name, with the extended model and its inverse."""
