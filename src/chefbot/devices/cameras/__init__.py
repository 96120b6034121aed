"""Depth cameras by the SDKs of their makers; each module needs an extra of its own."""
