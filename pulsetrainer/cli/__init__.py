"""The typer commands: parse, call one step, print."""
