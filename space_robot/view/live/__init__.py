"""The scene of a robot that flies now: found, listened to, drawn, and followed to its end."""
