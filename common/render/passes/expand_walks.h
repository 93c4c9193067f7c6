// ExpandWalks: walks over the expanded strands. A method that must see all strands before it draws any takes
// another walk: an additional expand pass over the same buffer and program. If all strands fit in the buffer
// at once, only the first walk expands them. All calls from the context's thread.
#pragma once

#include <memory>
#include <string>

#include "common/render/passes/strand_buffers.h"
#include "common/render/render_turn.h"

namespace strandcast {

class ExpandWalks {
 public:
  /// Starts with the pass `expand`, which writes `expanded` in batches.
  ExpandWalks(std::unique_ptr<RenderPass> expand, ExpandedStrands& expanded);

  /// Returns the pass of a further walk, named like the expand pass plus `purpose`. Passes that draw its
  /// strands must follow it directly; a pass that is not batched must separate two walks.
  std::unique_ptr<RenderPass> add(const std::string& purpose = "");
  ExpandedStrands& expanded() const { return expanded_; }

  /// Whether the camera's walk has been added.
  bool has_camera_walk = false;

  /// State shared by the passes of all walks.
  struct Shared {
    std::unique_ptr<RenderPass> expand;
    uint32_t batch_count = 0;  // of the first walk of the draw that is under way
  };

 private:
  std::shared_ptr<Shared> shared_;
  ExpandedStrands& expanded_;
  bool has_first_ = false;
};

}  // namespace strandcast
