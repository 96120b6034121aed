"""A robot's parts as shapes: outlines, layout, solids and their mass properties."""
