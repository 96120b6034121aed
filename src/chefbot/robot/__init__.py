"""The Robot: one value, read from one file."""
