// PictureEncoder: codes the pictures of one class, once for all its viewers. Tells what changed, and keeps
// what a viewer who joins or missed something needs. Frame thread.
#pragma once

#include <cstdint>
#include <memory>

#include "common/base/result.h"
#include "common/pictures/image_codec.h"
#include "common/pictures/picture.h"
#include "server/encode/picture_views.h"

namespace strandcast {

/// Quality of a picture that stands still.
inline constexpr int kStillQuality = 95;
/// Video keyframes made on request are at least so far apart: one viewer's losses are not everybody's.
inline constexpr int64_t kKeyframePauseNs = 1'000'000'000;

/// What goes into the header of a picture besides its numbers.
struct PictureStamp {
  uint16_t stream_id = 0;
  int64_t sim_time_ns = 0;
  int64_t time_ns = 0;  // server clock
};

class PictureEncoder {
 public:
  virtual ~PictureEncoder() = default;
  /// Null when the image is the one before. Quality 1..100.
  virtual Result<PicturePtr> encode(const Image& image, int quality, const PictureStamp& stamp) = 0;
  /// The last picture for viewers that have none: the very same one where that will do. Only after encode().
  virtual Result<PicturePtr> whole(const PictureStamp& stamp) = 0;
  /// When whole() may be called, on the clock of the stamps.
  virtual int64_t whole_due_ns() const { return 0; }
  /// The last picture as good as it gets; null when it is that already. Only after encode().
  virtual Result<PicturePtr> still(const PictureStamp& stamp) = 0;
  /// Of the newest picture; 0 = none yet.
  virtual uint32_t sequence() const = 0;
};

/// An encoder whose first picture is whole and has the number after `last_sequence`. `rate_hz`: of the
/// pictures at most.
Result<std::unique_ptr<PictureEncoder>> make_picture_encoder(const PictureView& view, double rate_hz,
                                                             uint32_t last_sequence);

}  // namespace strandcast
