"""Long runs of both faces in one process: is memory flat, and is the state that of the same run cut into restores?"""
