"""What stands beside the scene: how time passes, and of a cell its orders, trays and score."""
