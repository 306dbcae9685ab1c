"""The transfer path from the bearing to the sensor, and the amplitudes behind it."""
