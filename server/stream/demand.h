// Demand: what one reader of the stream wants. What the server encodes, draws and reads back follows from the
// demands of all readers and from nothing else: a session, a recorder and a relay ask alike.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "common/base/result.h"
#include "server/encode/picture_views.h"
#include "server/net/stream_costs.h"

namespace strandcast {

using ReaderId = uint64_t;  // never reused by one hub; 0 = nobody

/// Nothing by default.
struct Demand {
  std::optional<uint16_t>
      strand_stream;                   // strand frames of this stream_id: a class by a codec (stream_id_of)
  std::optional<PictureView> picture;  // frames rendered so
  double hair_px = 0.0;     // of strands: how high the hair is on the reader's screen; 0 = not told
  bool has_states = false;  // every published state, with its hash if it wants (state_hash)
  bool has_inputs = false;  // motion and wind as they come in
};

/// Where readers say what they want.
class DemandDesk {
 public:
  virtual ~DemandDesk() = default;
  /// In place of what the reader wanted before. Gives the class of its pictures, 0 without pictures.
  /// Unavailable or BadInput as PictureViews::assign, and NotFound for an unknown reader: then the demand of
  /// before stays.
  virtual Result<PictureClass> set_demand(ReaderId reader, const Demand& demand) = 0;
  /// What pictures are made to fit (fit_picture) before they are asked for.
  virtual PictureBudget picture_budget() const = 0;
};

}  // namespace strandcast
