"""Transfer path from the bearing to the sensor, and the amplitudes at the sensor."""
