"""Commands `cellwright operate`: driving a robot without a headset, over the public topics."""
