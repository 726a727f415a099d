"""What reaches the terminal: results, messages, colour, progress."""
