"""The transfer path from the bearing to the sensor, amplitudes behind it, sizes of defects."""
