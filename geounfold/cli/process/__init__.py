"""The process that a command runs in: signals, journal of outputs, supervision."""
