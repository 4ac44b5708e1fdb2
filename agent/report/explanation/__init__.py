"""The page of `explain`: words, rows, places and pictures of what was found."""
