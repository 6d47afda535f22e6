"""The command line ``go2-wbc``: one module per subcommand, imported only when it is called."""
