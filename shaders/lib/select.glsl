// A choice that is written the same for one invocation and for lanes of them (common/simd/lanes.h): both sides are
// evaluated.
#pragma once

#define select(which, yes, no) ((which) ? (yes) : (no))
