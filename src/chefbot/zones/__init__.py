"""Zones of a map: keep-out, slow and preferred areas, and one-way lanes."""
