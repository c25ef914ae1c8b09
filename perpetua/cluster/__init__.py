"""Where rooms are worked on: processes of this machine."""
