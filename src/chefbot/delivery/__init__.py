"""State machine of food delivery orders."""
