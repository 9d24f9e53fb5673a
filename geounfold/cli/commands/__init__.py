"""One module for each command: check paths and options, read, compute, write all together."""
