"""Where on a known map am I."""
