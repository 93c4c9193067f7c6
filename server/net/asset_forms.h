// AssetForms: an asset in a layout that a client takes: those of earlier versions know floats only. Network
// thread.
#pragma once

#include <array>
#include <cstdint>

#include "common/strands/frame_header.h"

namespace strandcast {

class AssetForms {
 public:
  /// Returns the frame of an asset in a layout up to `newest`, as in the Hello. Translates a newer one once
  /// for each layout, and remembers those of the last. A frame that cannot be translated comes back
  /// unchanged: its receiver says why it fails.
  EncodedFramePtr fit(const EncodedFramePtr& asset, uint32_t newest);

 private:
  EncodedFramePtr from_;
  std::array<EncodedFramePtr, 2> translated_;  // Floats, Numbers; null until somebody takes that
};

}  // namespace strandcast
