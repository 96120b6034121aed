"""Laser scans as nodes take them: without skew, and missed when they do not come."""
