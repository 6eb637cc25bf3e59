"""Parts of controller nodes of the io_teleop stack."""
