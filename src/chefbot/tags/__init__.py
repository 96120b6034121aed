"""AprilTags: their images, their detection in a picture, and their poses relative to the camera."""
