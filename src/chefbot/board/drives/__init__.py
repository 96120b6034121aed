"""Motor drives with a controller of their own, on a serial line without a motor board."""
