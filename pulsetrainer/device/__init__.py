"""Frames, messages, transport, session, device and the virtual bench."""
