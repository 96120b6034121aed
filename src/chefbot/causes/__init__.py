"""Why the robot slows down, stops, takes a detour or fails: reports of checks, joined to chains of causes."""
