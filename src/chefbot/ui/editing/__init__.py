"""Changes of the places and zones of the map in the web UI."""
