"""Pose by counting wheel turns."""
