"""What acts and moves where two yarns cross: contact zones, resultants, kinematics."""
