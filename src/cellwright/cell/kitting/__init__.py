"""Orders, kits, trays, the score and the referee: pure logic without physics."""
