// Loads groom files of any known format into head space: loader by extension, axes, origin, unit, resampling,
// pinning and validation. Any thread.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/glm.hpp>
#include <optional>
#include <string>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom.h"
#include "common/groom/placement.h"
#include "common/groom/stated_groom.h"

namespace strandcast {

inline constexpr size_t kMaxGroomFiles = 8;  // that one head of hair comes in

struct GroomFileOptions {
  std::filesystem::path path;                     // .tfx, .hair, .ply, .usd (any form) or .abc
  std::vector<std::filesystem::path> more_paths;  // further parts of the same hair: the same unit and axes
  float unit_m = 0.0f;  // metres per file unit; 0 = as the file says, else guessed from the size of the head
  std::optional<bool> is_z_up = false;  // as GroomPlacement; empty = as the file says, else guessed
  bool is_upside_down = false;          // likewise, where is_z_up is stated
  std::optional<float> yaw_deg = 0.0f;  // as GroomPlacement; empty = guessed
  // As GroomPlacement; empty = 0, or the middle of likely hair that is far from there.
  std::optional<glm::vec3> origin = glm::vec3(0.0f);
  // Resample to this many, 2..kMaxVertexCount; 0 = keep, as far as a uniform groom can.
  uint32_t vertex_count = 0;
  std::optional<Pinning> pinning;    // empty: as the file says
  uint32_t strand_vertex_count = 0;  // of a .ply, as load_ply()
  GuideUse guides = GuideUse::LeaveOut;
};

struct PlacedGroom {
  Groom groom;
  StrandLabels labels;  // of its strands and vertices
  HairMaterial material;
  GroomPlacement placement;
  bool is_of_head = true;  // its roots might be those of a head
  // Why no head has this hair as it was placed, and what fits; empty where one may. --check refuses it, and a
  // start warns of it. No note says it again.
  std::string unlikely;
  std::vector<std::string>
      notes;  // a sentence for each thing that the file says or that was guessed, and why
};

/// Adds a sentence to others, parted by a semicolon; an empty one adds nothing.
inline void add_sentence(std::string& sentences, const std::string& sentence) {
  if (!sentences.empty() && !sentence.empty()) sentences += "; ";
  sentences += sentence;
}

/// Returns the value of guess_unit(): metres per file unit.
float guess_unit_m(const Groom& groom);

/// Loads, joins, rotates, moves, scales and checks a groom; the result is uniform. If `vertex_count` is 0, a
/// non-uniform groom is resampled to its largest vertex count within 2..kMaxVertexCount. So is one outside
/// that range. Errors name the file and the offending value.
Result<PlacedGroom> load_placed_groom(const GroomFileOptions& options);

/// Loads a groom and returns it without its placement.
Result<Groom> load_groom(const GroomFileOptions& options);

}  // namespace strandcast
