// Limits of all strands and meshes from files, generators or streams. Checked before anything is allocated.
#pragma once

#include <cstdint>

namespace strandcast {

inline constexpr uint32_t kMaxStrandCount = 200'000;
inline constexpr uint32_t kMinVertexCount = 2;   // per strand
inline constexpr uint32_t kMaxVertexCount = 64;  // per strand, after resampling
inline constexpr uint64_t kMaxGroomVertices = 16'000'000;
inline constexpr float kMaxGroomExtentM = 100.0f;  // |coordinate| in head space

inline constexpr uint32_t kMaxMeshTriangles = 500'000;
inline constexpr float kMaxMeshExtentM = 100.0f;  // |coordinate| in head space

}  // namespace strandcast
