"""The Preisach plane, operator, identification, inversion, signals and metrics: numpy and scipy only."""
