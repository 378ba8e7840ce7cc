"""Bags of flights: rosbag2 bags in MCAP, written and read without ROS."""
