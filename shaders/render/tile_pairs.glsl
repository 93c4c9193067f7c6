// Order of a tile's segments, each with its depth and the number of its first point.
bool is_before(uvec2 a, uvec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); }
