"""Supervision of a launch's worker processes: start, heartbeat, restart, and restored state."""
