"""Bags: what was said on the wire, kept as rosbag2 keeps it, and said again."""
