"""Pictures: bodies, surfaces, grades, comparisons."""
