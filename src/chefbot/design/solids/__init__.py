"""A robot's solids as meshes, CAD files and pictures."""
