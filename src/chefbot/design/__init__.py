"""Descriptions that are functions of a Robot."""
