"""Calibration of wheels, gyro and sensor mounts of a built robot, from drives between scanned stations."""
