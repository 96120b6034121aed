"""The wire to other processes, machines and ROS 2: rmw_zenoh's protocol over Eclipse Zenoh."""
