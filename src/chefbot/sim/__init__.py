"""The physical robot and its world, in MuJoCo."""
