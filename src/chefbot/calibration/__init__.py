"""What one built robot's wheels, gyro and sensor mounts really are, from drives between places that it saw."""
