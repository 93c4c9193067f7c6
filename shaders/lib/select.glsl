// What lets a law compile for lanes of invocations on the CPU as well (common/render/laws.h): LAW in front of each of its
// functions, and a choice whose both sides are evaluated.
#pragma once

#ifndef __cplusplus
#define LAW
#define select(which, yes, no) ((which) ? (yes) : (no))
#endif
