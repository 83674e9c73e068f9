"""Storage: atomic writing of files, and strict reading of text, YAML, tables of numbers and archives."""
