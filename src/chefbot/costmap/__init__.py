"""Layered costmaps: static map, obstacle layers and inflation."""
