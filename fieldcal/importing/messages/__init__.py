"""Messages of logs that programs write: dataflash, MCAP, ROS, ULog."""
