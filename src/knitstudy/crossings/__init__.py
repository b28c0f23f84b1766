"""What acts and moves where two yarns cross. No solver."""
