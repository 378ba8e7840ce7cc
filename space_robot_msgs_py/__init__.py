"""What the nodes share: samples, their wire form, topics, settings, errors, bags.

Knows no dynamics and no control law; only `space_robot_msgs_py.ros` needs ROS.
"""
