"""What every room stands on: arrays, checks of arguments, messages, tolerances, progress, files of text and numbers."""
