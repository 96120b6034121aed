"""Keys, certificates and the secured router of several robots."""
