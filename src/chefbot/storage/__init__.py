"""Files that stay whole: atomic writes, MCAP, maps, places."""
