"""Surfaces of a body: its hull, and the hull's split into top, bottom and rim."""
