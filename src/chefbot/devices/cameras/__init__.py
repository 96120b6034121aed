"""Drivers of depth cameras, by the SDKs of their makers, and of USB cameras; each needs an extra of its own."""
