"""Laser scans for nodes: without skew, and with a report when none arrive."""
