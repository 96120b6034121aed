"""Wiring of a robot's motor board: which terminal goes to which pin, drawn."""
