"""What stands above columns: channels and units, of one IMU or of several."""
