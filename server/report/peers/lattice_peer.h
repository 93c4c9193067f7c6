// Stream codecs from lossless coders of integers: positions are rounded to the coarsest cubic lattice that
// keeps the bound, and coded directly or as residuals of a prediction in time. One thread.
#pragma once

#include <memory>

#include "server/report/peers/integer_coder.h"
#include "server/report/stream_codec.h"

namespace strandcast {

enum class PeerPrediction { None, Temporal };

struct LatticePeerDesc {
  float quantum_m = 0.0f;  // lattice step
  PeerPrediction prediction = PeerPrediction::None;
  std::unique_ptr<IntegerCoder> (*make_coder)() = nullptr;
};

std::unique_ptr<StreamCodec> make_lattice_peer(const LatticePeerDesc& desc, const StreamShape& shape);

}  // namespace strandcast
