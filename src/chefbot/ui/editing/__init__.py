"""Changes of the places and zones of the map on the page."""
