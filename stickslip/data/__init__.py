"""What was measured: traces and their readers, events, campaigns, and the rig held against the motion."""
