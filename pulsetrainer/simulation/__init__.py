"""What only pretends to be a device: the bench, the emulator, the bad wire."""
