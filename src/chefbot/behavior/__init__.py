"""What to do when the way is blocked."""
