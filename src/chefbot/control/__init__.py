"""Local control: from a path to velocity commands and wheel speeds."""
