"""One workflow per subcommand: paths and options in, files and a result object out."""
