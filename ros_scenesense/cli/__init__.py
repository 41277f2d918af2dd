"""The `scenesense` command: one module per subcommand."""
