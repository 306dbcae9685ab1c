"""Models of a bearing in motion, one file or folder for each level of fidelity, and the solvers that run them."""
