"""Protocols of IMUs on a serial line of their own: pure, bytes in and samples out."""
