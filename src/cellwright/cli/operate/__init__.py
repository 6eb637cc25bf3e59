"""`cellwright operate`: a robot driven without a headset, by the topics that everybody uses."""
