"""Laws from motion: the force along it, fits, the diagnosis, the forecast."""
