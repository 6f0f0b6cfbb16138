"""The stages of a diagnosis: one decision a file, what it decides and why in its docstring."""
