"""Flights on a GPU: the closed loop translated to CUDA C++, one flight a thread, the same bits.

`translation` makes the text, `structs` the flights' memory, `device` compiles and runs,
`batch` flies.
"""
