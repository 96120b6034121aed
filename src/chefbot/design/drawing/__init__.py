"""Technical drawings of a robot's parts."""
