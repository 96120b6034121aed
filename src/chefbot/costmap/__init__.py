"""Where the robot may go, and at what price."""
