"""Causes in the web UI: shown, and recorded over all runs with pictures of the moment."""
