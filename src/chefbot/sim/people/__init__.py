"""People who walk by social forces through any world, and what they do on their way."""
