"""Crash-safe files: atomic writes, MCAP recordings, maps, named places."""
