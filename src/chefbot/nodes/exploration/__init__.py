"""Parts of the node that explores: its map of frontiers, its drives, and what it reports."""
