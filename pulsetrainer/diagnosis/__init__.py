"""What the model gets wrong, and why."""
