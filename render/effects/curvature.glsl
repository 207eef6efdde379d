// Metres by which ground sinks at `distance` metres in the plane.
float curvature_drop(float distance, float per_square) { return per_square * distance * distance; }
