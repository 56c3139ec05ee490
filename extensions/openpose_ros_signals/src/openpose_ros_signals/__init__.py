"""What people do, told by their joints: postures, gestures, pointing, facing, walking, falls."""
