"""Missions of the web UI in addition to deliveries."""
