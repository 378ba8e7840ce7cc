"""Elementary functions from + - * / and square root only: the same bits on every processor.

The C library and NumPy choose the code of these functions by processor, so their last bits may
differ. The functions here consist of operations that are rounded by IEEE 754 on every processor.
"""
