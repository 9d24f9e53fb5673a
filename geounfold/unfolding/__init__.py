"""The unfolding of a body: the stages in order, the options, the result."""
