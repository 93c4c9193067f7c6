// Loader for strands in `.ply` files, text or binary of either byte order: bare points, so many to a strand,
// as neural hair tools leave them, or with counts, lists or edges that say where strands begin. Coordinates
// stay in file units; groom_file.h applies unit and axes. Any thread.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <span>
#include <string>

#include "common/base/result.h"
#include "common/groom/placement.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

inline constexpr size_t kMaxPlyHeaderBytes = 64u << 10;
inline constexpr size_t kMaxPlyElements = 16;     // kinds of rows
inline constexpr size_t kMaxPlyProperties = 256;  // of one element; splats of hair have a hundred
/// Points of one strand where neither the file nor its points say: what neural hair tools leave.
inline constexpr uint32_t kUsualPlyStrandVertices = 100;

/// Loads strands in file units, root vertex pinned. Where strands begin is said, the first of these that
/// there is, by `strand_vertex_count` (0 = not given), by an element `strand` (or `curve`) with a list of
/// vertices, or a number of segments (`nsegs`) or vertices (`nverts`) each, by an element `edge`, by a
/// comment, or guessed by guess_strand_vertex_count(). Other properties and elements are skipped. Errors name
/// the file and the offending header line, row or vertex.
Result<StatedGroom> load_ply(const std::filesystem::path& path, uint32_t strand_vertex_count);

/// As load_ply, from bytes in memory; errors carry no file name.
Result<StatedGroom> read_ply(std::span<const std::byte> file, uint32_t strand_vertex_count);

/// How many points each strand has when nothing but points is there: the divisor of their number at whose
/// multiples the way from one point to the next is a jump, and nowhere else. 0 when nothing speaks for any.
Guess<uint32_t> guess_strand_vertex_count(std::span<const glm::vec3> points);

}  // namespace strandcast
