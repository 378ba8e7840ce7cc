"""The robot as data, its equations of motion, its hardware, and arithmetic that is exact."""
