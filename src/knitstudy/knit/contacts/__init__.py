"""Forces and motions where two yarns cross: contact zones, resultants, kinematics."""
