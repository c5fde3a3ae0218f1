//! Model magnitudes: surfaces, lights, and the light that comes by way of the Earth.
