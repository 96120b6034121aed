"""Robot descriptions from untrusted sources: URDF, and xacro that a confined process expands."""
