"""What any program needs: run folders, caches, processes, units."""
