"""The typer commands: parse, call one flow, print."""
