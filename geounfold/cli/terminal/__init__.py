"""What a user sees on the terminal: messages, progress, time left."""
