"""Missions of the web UI besides deliveries."""
