"""Simulated worlds: read from files or maps, made of solids, with doors and people."""
