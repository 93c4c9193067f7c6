// What lets a law compile for lanes of invocations on the CPU as well (common/render/laws.h): LAW in front of each of its
// functions, and a choice whose both sides are evaluated.
#pragma once

#ifndef __cplusplus
#define LAW
#define select(which, yes, no) ((which) ? (yes) : (no))
// What may differ between strands, for kernels that run over lanes of strands too: it is chosen by, never branched on.
// is_any() asks whether work is needed for one of them at least.
#define lane_bool bool
#define lane_uint uint
// The same in all strands, unlike any other float.
#define uniform_float float
#define is_any(which) (which)
#define lanes_that(value) (value)
// An array of vec4, and its element at an index that may differ between strands.
#define lookup_table samplerBuffer
#define look_up(table, index) texelFetch(table, int(index))
#endif
