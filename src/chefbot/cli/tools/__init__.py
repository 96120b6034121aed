"""The command groups of the ROS graph tools: `topic`, `node`, `service`, `action`, `param` and `bag`."""
