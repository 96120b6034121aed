"""Implementation of the commands that stand alone: `demo`, `launch`, `replay`, `sim` and `prove`."""
