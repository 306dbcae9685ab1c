"""Names for the types of NumPy arrays; they state the type of the elements, but neither shape nor unit."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
IntArray = NDArray[np.int64]
