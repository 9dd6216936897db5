"""Laws of the joint, and quantities of the field from what runs wrote (chord pressure, fits); never solves."""
