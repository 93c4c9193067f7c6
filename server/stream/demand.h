// Demand: what one reader of the stream wants. The demands of all readers alone decide what the server
// encodes, draws and reads back; sessions, recorders and relays use the same mechanism.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "server/encode/picture_views.h"
#include "server/net/stream_costs.h"

namespace strandcast {

using ReaderId = uint64_t;  // never reused by one hub; 0 = nobody

/// What a reader wants; by default nothing.
struct Demand {
  std::optional<uint16_t>
      strand_stream;                   // strand frames of this stream_id: a class by a codec (stream_id_of)
  std::optional<PictureView> picture;  // frames rendered so
  bool awaits_picture = false;         // none now, but it will want them at once when its window is seen
  double hair_px = 0.0;     // of strands: how high the hair is on the reader's screen; 0 = not told
  bool has_states = false;  // every published state, with its hash if it wants (state_hash)
  bool has_inputs = false;  // motion and wind as they come in
};

/// Interface through which readers state their demands.
class DemandSink {
 public:
  virtual ~DemandSink() = default;
  /// Replaces the reader's demand and returns the class of its pictures, 0 without pictures. Unavailable or
  /// BadInput as in PictureViews::assign(), NotFound for an unknown reader; then the previous demand stays.
  virtual Result<PictureClass> set_demand(ReaderId reader, const Demand& demand) = 0;
  /// Returns the budget that picture sizes must fit (fit_picture()) before they are demanded.
  virtual PictureBudget picture_budget() const = 0;
};

}  // namespace strandcast
