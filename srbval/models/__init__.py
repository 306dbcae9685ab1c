"""Models of a bearing in motion, one file or folder per rung of the ladder, and the solvers that run them."""
