"""The arguments of every command, one module for each group of commands."""
