"""Operator agent: lets a person work the arms of a cell, over topics that its page, keys and programs publish on."""
