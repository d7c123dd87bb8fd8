"""What a simulated rig can be made to do while it runs (`force-gateway sim`): faults of its lines and its air, effects of the
catalogue, and what is around its tool. Names and checks are pure; the world that obeys them is in `world.py`.
"""
