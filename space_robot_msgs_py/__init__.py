"""Code shared by the nodes: samples, serialization, topics, settings, errors, bags.

Independent of dynamics and control laws; only `space_robot_msgs_py.ros` needs ROS.
"""
