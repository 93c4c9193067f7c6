// AssetForms: an asset in a layout that a client takes: those of earlier versions know floats only. Network
// thread.
#pragma once

#include <cstdint>

#include "common/strands/frame_header.h"

namespace strandcast {

class AssetForms {
 public:
  /// Returns the frame of an asset in a layout up to `newest`, as in the Hello. Translates a newer one once,
  /// and remembers the last. A frame that cannot be translated comes back unchanged: its receiver says why
  /// it fails.
  EncodedFramePtr fit(const EncodedFramePtr& asset, uint32_t newest);

 private:
  EncodedFramePtr from_;
  EncodedFramePtr translated_;
};

}  // namespace strandcast
