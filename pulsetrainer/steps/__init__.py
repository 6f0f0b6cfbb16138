"""One module per subcommand: options in, result out; no printing."""
