// Loads the hair of a scene's files for simulation: on the head, in an order of which every prefix covers it.
// Server and exports use it. Any thread.
#pragma once

#include <cstdint>
#include <vector>

#include "common/base/result.h"
#include "common/groom/groom_file.h"
#include "common/scene/scene_desc.h"

namespace strandcast {

struct FileGroom {
  PlacedGroom placed;           // its strands in the order of the files, labels too
  std::vector<uint32_t> order;  // (strand_count) place in the files of each simulated strand

  /// Returns the strands in the order in which they are simulated.
  Groom simulated() const { return reorder(placed.groom, order); }
};

/// Loads the files; without an origin their head is moved to the head joint, which a head turns about much
/// more nearly than about a file's origin between the feet. Errors of load_placed_groom().
Result<FileGroom> load_file_groom(const FileGroomDesc& file);

}  // namespace strandcast
