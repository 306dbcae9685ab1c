"""Models of a bearing in motion, one rung a folder, and the solvers that run them."""
