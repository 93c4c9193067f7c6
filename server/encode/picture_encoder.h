// PictureEncoder: encodes the pictures of one class, once for all its viewers. Sends changes, and keeps what
// viewers need that join or have lost something. Frame thread.
#pragma once

#include <cstdint>
#include <memory>

#include "common/base/result.h"
#include "common/pictures/image_codec.h"
#include "common/pictures/picture.h"
#include "server/encode/picture_views.h"

namespace strandcast {

/// Quality of a picture that does not change any more.
inline constexpr int kStillQuality = 95;
/// Shortest time between video keyframes made on request, so that one viewer's losses do not burden the
/// others.
inline constexpr int64_t kKeyframePauseNs = 1'000'000'000;

/// Values of a picture's header besides its sequence numbers.
struct PictureStamp {
  uint16_t stream_id = 0;
  int64_t sim_time_ns = 0;
  int64_t time_ns = 0;    // server clock
  bool is_still = false;  // the finest of this state
};

class PictureEncoder {
 public:
  virtual ~PictureEncoder() = default;
  /// Encodes an image; null if it equals the one before. Quality 1..100.
  virtual Result<PicturePtr> encode(const Image& image, int quality, const PictureStamp& stamp) = 0;
  /// Returns the last picture for viewers that have none; the same object if it serves them. Call it only
  /// after encode().
  virtual Result<PicturePtr> whole(const PictureStamp& stamp) = 0;
  /// Returns when whole() may be called next, on the clock of the stamps.
  virtual int64_t whole_due_ns() const { return 0; }
  /// Returns the last picture at its finest quality; null if it already is. Call it only after encode().
  virtual Result<PicturePtr> still(const PictureStamp& stamp) = 0;
  /// Returns the number of the newest picture; 0 = none yet.
  virtual uint32_t sequence() const = 0;
};

/// Makes an encoder whose first picture is whole and has the number after `last_sequence`. `rate_hz`: highest
/// picture rate.
Result<std::unique_ptr<PictureEncoder>> make_picture_encoder(const PictureView& view, double rate_hz,
                                                             uint32_t last_sequence);

}  // namespace strandcast
