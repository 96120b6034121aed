"""Command line tools for the ROS graph, like the ros2 command's; ROS 2 nodes are shown like chefbot's own."""
