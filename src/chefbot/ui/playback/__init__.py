"""Recorded logs in the web UI: their playback, and downloads of incidents."""
