"""The source thesis: its published drag surfaces, their fits, its experiment and its tables."""
