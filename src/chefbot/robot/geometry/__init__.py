"""A robot's parts as shapes: layout, outlines, solids and their mass properties."""
