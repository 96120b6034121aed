"""Base classes of nodes that report why the robot slows down, stops, takes a detour or fails, and their chains."""
