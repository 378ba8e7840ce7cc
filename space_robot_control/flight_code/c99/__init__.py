"""Translator of kernels, a small part of Python, to C99."""
