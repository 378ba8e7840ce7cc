"""Sine, exponential and their like from + - * / and square root alone: the same bits everywhere.

The C library and NumPy choose the code of these functions by the processor, and their last bits
with it. What is here is rounded as IEEE 754 says, operation by operation, on every processor.
"""
