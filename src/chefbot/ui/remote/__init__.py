"""Programs that connect to the web UI of a running robot, as a browser does."""
