"""One thin shell an algorithm."""
