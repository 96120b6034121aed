"""Depth images and laser scans."""
