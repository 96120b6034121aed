"""ROS 2 without ROS, in pure Python: rmw_zenoh's protocol, bags, DDS and command-line tools."""
