"""Frontier-based exploration of unknown space."""
