"""What the program makes of measured records, a module for each kind of them: see docs/make_real_data.py."""
