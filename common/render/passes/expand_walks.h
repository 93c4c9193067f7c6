// Walks over the expanded strands. A method that has to see all strands before it draws any takes another
// walk: a pass of its own in front, over the same buffer and the same program. Where all strands fit in the
// buffer at once, they are expanded in the first walk only. All calls from the context's thread.
#pragma once

#include <memory>
#include <string>

#include "common/render/passes/strand_buffers.h"
#include "common/render/render_turn.h"

namespace strandcast {

class ExpandWalks {
 public:
  /// `expand` writes `expanded`, in batches.
  ExpandWalks(std::unique_ptr<RenderPass> expand, ExpandedStrands& expanded);

  /// The pass of one more walk, named as the expand pass with `purpose` behind it. What draws the walk's
  /// strands follows it directly; a pass that is not batched has to stand between two walks.
  std::unique_ptr<RenderPass> add(const std::string& purpose = "");
  ExpandedStrands& expanded() const { return expanded_; }

  /// Whether the camera has walked already.
  bool has_camera_walk = false;

  /// What the passes of all walks share.
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
