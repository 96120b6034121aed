"""Odometry from wheel encoders alone, and fused with an IMU by an extended Kalman filter."""
