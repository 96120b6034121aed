"""Paths over a costmap."""
