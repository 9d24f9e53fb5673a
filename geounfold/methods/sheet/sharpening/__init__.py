"""Sharpening: the mid surface corrected by the blocks themselves."""
