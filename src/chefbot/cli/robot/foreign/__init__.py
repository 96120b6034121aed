"""Robot descriptions of strangers: URDF, and xacro that a confined process expands."""
