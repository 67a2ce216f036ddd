"""What was measured: traces and their readers, events, campaigns, and checks of the rig against the motion."""
