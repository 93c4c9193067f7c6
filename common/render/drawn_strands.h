// DrawnHair: strands as a picture shows them (keys, followers, style), with width and colour, for programs
// that draw them elsewhere: a path tracer, exported files. No GL; one thread.
#pragma once

#include <cstdint>
#include <glm/glm.hpp>
#include <vector>

#include "common/base/result.h"
#include "common/render/strand_detail.h"
#include "common/render/tiles/strand_expansion.h"
#include "common/render/tiles/tile_frame.h"
#include "common/scene/scene_desc.h"
#include "common/strands/scene_asset.h"

namespace strandcast {

/// All strands of a look, as fine as its segments, strand after strand, root first.
struct DrawnStrands {
  std::vector<uint32_t> first_point;  // (strand_count + 1)
  std::vector<glm::vec3> position_m;  // (point_count) head space
  // (point_count) diameter; less where a strand comes out of the skin or fades out, in place of its opacity
  std::vector<float> width_m;
  std::vector<glm::vec3> color;  // (point_count) of hair as a whole, linear, 0..1; no light, no dark roots

  uint32_t strand_count() const {
    return first_point.empty() ? 0 : static_cast<uint32_t>(first_point.size() - 1);
  }
};

class DrawnHair {
 public:
  /// Prepares the hair of an asset. BadInput for an inconsistent asset, LimitExceeded for more points than
  /// any picture has.
  static Result<DrawnHair> make(const SceneAsset& asset, const LookDesc& look);

  uint32_t strand_count() const { return detail_.strand_count; }
  /// Returns the strands; `position_m`: (vertex_count x key_count), vertex-major, head space. Counts, widths
  /// and colours are the same for all positions.
  DrawnStrands strands(const std::vector<glm::vec3>& position_m);

 private:
  DrawnHair(const SceneAsset& asset, const LookDesc& look, const DetailFacts& facts);

  LookDesc look_;
  DetailFacts facts_;
  StrandDetail detail_;
  StrandExpansion expansion_;
  StrandPoints points_;
};

}  // namespace strandcast
