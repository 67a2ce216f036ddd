"""Laws, one increment at a time: contact, effects, the block, the sensor."""
