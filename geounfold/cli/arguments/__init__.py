"""The arguments and the help of every command, one module for each group of commands."""
