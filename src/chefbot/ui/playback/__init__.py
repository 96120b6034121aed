"""Playback of recorded logs in the web UI."""
