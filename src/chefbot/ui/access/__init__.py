"""Who may use the web UI, how many at once, and the log of what they did."""
