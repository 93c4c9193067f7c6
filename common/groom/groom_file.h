// load_groom: a groom file of any known kind into head space: loader by extension, axes, origin, unit,
// resampling, pinning, validation. Any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>

#include "common/base/result.h"
#include "common/groom/groom.h"

namespace strandcast {

struct GroomFileOptions {
  std::filesystem::path path;  // .tfx or .hair
  float unit_m = 0.0f;         // metres per file unit; 0 = guessed from the size of the head
  bool is_z_up = false;        // +Z up and -Y forward in the file; turned to +Y up and +Z forward
  glm::vec3 origin{0.0f};      // point that becomes the head joint: file units, after the axes are turned
  // Resample to this many, 2..kMaxVertexCount; 0 = keep, as far as a uniform groom can.
  uint32_t vertex_count = 0;
  std::optional<Pinning> pinning;  // empty: as the file says
};

/// The first of metre, centimetre, millimetre and inch in which the sphere through the roots has the size of
/// a human head, else whatever makes it one. `groom` is in file units, +Y up.
float guess_unit_m(const Groom& groom);

/// Loads, turns, moves, scales and checks a groom; the result is uniform. With vertex_count 0 a ragged groom,
/// or one outside of 2..kMaxVertexCount, is resampled to its largest vertex count clamped into these limits.
/// Errors name the file and the offending value.
Result<Groom> load_groom(const GroomFileOptions& options);

}  // namespace strandcast
