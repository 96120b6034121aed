"""Bridge between the event loop's nodes and the ROS 2 graph, in both directions."""
