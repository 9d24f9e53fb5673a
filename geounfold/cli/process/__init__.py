"""The process of a command: signals, the journal of its outputs, supervision."""
