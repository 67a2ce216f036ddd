"""Own solver against others on the same bank at the same accuracy: ``python -m tests.benchmark``. Not a test."""
