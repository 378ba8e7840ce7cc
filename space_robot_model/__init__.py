"""Robot model, equations of motion, hardware data sheets, reproducible arithmetic."""
