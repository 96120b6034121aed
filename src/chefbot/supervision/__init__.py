"""Processes of a launch: started, watched by heartbeat, restarted with their state."""
