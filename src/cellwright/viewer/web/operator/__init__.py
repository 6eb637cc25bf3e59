"""The browser operator: who looks at a robot on a page drives it there, over the topics that everybody speaks on."""
