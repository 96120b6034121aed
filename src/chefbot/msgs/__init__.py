"""Messages with the ROS 2 names and fields of their types, and their CDR bytes."""
