"""Storage: files that are whole or not there, text and YAML read whole, tables of numbers read strictly."""
