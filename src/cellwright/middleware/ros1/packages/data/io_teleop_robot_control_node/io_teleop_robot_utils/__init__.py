"""What controller nodes of the io_teleop stack are made of."""
