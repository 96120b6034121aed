"""Nodes that make scans, point clouds and tags of the images of cameras."""
