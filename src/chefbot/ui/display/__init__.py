"""What the web UI shows: views of messages and of the robot."""
