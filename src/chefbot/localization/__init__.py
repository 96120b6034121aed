"""Localization on a known map."""
