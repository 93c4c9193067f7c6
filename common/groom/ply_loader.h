// Loader for strands in `.ply` files, text or binary of either byte order. Accepts bare points with a fixed
// number per strand, as neural hair tools write them. Also accepts counts, lists or edges that say where
// strands begin. Coordinates stay in file units; groom_file.h applies unit and axes. Any thread.
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
/// Points per strand where neither the file nor its points tell; neural hair tools write this many.
inline constexpr uint32_t kUsualPlyStrandVertices = 100;

/// Loads strands in file units, root vertex pinned. Errors name the file and the offending header line, row
/// or vertex.
/// Strands are separated by the first of these that is present: `strand_vertex_count` (0 = not given); an
/// element `strand` or `curve` with a list of vertices or a number of segments (`nsegs`) or vertices
/// (`nverts`); an element `edge`; a comment; guess_strand_vertex_count(). Other properties and elements are
/// skipped.
Result<StatedGroom> load_ply(const std::filesystem::path& path, uint32_t strand_vertex_count);

/// Loads like load_ply() from bytes in memory; errors carry no file name.
Result<StatedGroom> read_ply(std::span<const std::byte> file, uint32_t strand_vertex_count);

/// Guesses the points per strand of bare points. It is the divisor of their number for which jumps between
/// successive points occur at its multiples and nowhere else. Returns 0 if there is none.
Guess<uint32_t> guess_strand_vertex_count(std::span<const glm::vec3> points);

}  // namespace strandcast
