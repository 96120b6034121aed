"""Base classes of the navigator, and parameters of the controller server."""
