"""The command groups of the ROS graph tools: `topic`, `node`, `service`, `action`, `param`, `bag` and `graph`."""
