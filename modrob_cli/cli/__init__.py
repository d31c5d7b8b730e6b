"""Command line: one thin file per subcommand; arguments in, workflow called, result shown."""
