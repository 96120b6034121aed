"""A robot in the formats of other programs: URDF, SDF, MJCF, firmware header, ROS 2 packages."""
