// The general codecs that strands are compared with: those of this build, as rows of the report. Only
// strandcast-report links them.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "server/report/peers/lattice_peer.h"

namespace strandcast {

/// Returns all peers of this build whose result depends on the bound, each on plain positions and on
/// residuals of a prediction in time.
std::vector<StreamCodecRow> peer_stream_codecs(double bound_m);
/// Returns peers without a bound: zstd on floats, and on 16-bit integers over a fixed box, plain and
/// predicted.
std::vector<StreamCodecRow> bound_free_stream_codecs();
/// Returns a sentence for each peer whose library was missing when this program was built.
std::vector<std::string> missing_peers();

std::unique_ptr<StreamCodec> make_float_peer(const StreamShape& shape);
/// Makes zfp in accuracy mode, with one array (strands x vertices) per axis. The tolerance is the largest
/// power of two that has kept the bound in every frame; finding it is not timed.
std::unique_ptr<StreamCodec> make_zfp_peer(double bound_m, PeerPrediction prediction,
                                           const StreamShape& shape);

}  // namespace strandcast
