"""Odometry from wheel encoders alone, and fused with IMU and scan matching by an extended Kalman filter."""
