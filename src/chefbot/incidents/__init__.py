"""Incidents: the last minute of a robot before something went wrong, saved as a file that can be played back."""
