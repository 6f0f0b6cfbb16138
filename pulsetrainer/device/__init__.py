"""The device: bytes, frames, messages and commands; plays, their heat, and the limits of both."""
