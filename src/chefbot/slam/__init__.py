"""Simultaneous localization and mapping."""
