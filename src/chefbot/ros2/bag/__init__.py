"""Bags in rosbag2's format: recording topics, reading bags and playing them back."""
