"""Navigation: state estimation from sensor measurements."""
