"""What stands where: descriptions turned into a MuJoCo model. Knows no time."""
