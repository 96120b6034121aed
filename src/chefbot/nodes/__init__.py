"""Nodes: thin wrappers that connect algorithms to topics and actions."""
